// One tick with everything that belongs to it: planned faults, the transfer, USB traffic meanwhile. Shared by the
// simulation and the bench.
#pragma once

#include <array>
#include <map>

#include "fault_log.h"
#include "urb_scheduler.h"

namespace bridge_sim
{

class TickRunner
{
  public:
    // No plan: no faults.
    TickRunner(Rig &rig, UrbScheduler &scheduler, std::optional<FaultPlan> plan, FaultLog &log);

    // May a tick be produced as far as USB goes? Every frame made so far must have a transfer to go into; two packets
    // may be on their way, one being framed and one being sent.
    bool ready() const;

    // May the tick after a stop be produced? Its frame waits for room in the FIFO, which a host that is away does not
    // make.
    bool may_end() const;

    // Produces the tick of this number; `fields` has one entry per populated lane.
    void tick(uint64_t number, const sim_field *fields);

    // The one tick after a stop.
    void last_tick(const sim_field *fields);

    // From the next tick on this lane's sensor says nothing, or answers again. A planned fault of the lane comes first.
    void set_dead(size_t lane, bool dead);

    // The bridge lost its power: a fault that waited for its next transfer goes with it.
    void unplugged();

    // Irregularities on the wire that the planned faults do not explain, and planned ones that did not take place.
    // Throws std::runtime_error if there are any.
    void check_usb() const;

  private:
    void inject_lane_fault(uint64_t number);
    void silence_dead(uint64_t number);
    const sim_field *inject_lasting(uint64_t number, const sim_field *fields);
    void inject_usb_fault(uint64_t number);
    void start_usb_fault(const UsbFault &fault);

    Rig &rig_;
    UrbScheduler &scheduler_;
    std::optional<FaultPlan> plan_;
    FaultLog &log_;
    std::map<size_t, uint64_t> dead_;      // by lane: the tick of its next reading, after a resynchronisation
    std::map<size_t, sim_field> frozen_;   // by lane: what its sensor goes on to read
    std::array<sim_field, LANES> shown_{}; // the fields, with those
    std::optional<LaneFault> in_transfer_; // a link fault whose record comes with the next tick's transfer
    uint64_t back_at_ = 0;                 // tick at which a host that stayed away returns
    bool away_ = false;
};

} // namespace bridge_sim
