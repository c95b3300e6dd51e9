// Host controller's schedule: queues of transfers per endpoint, one USB transaction at a time, results handed back.
#pragma once

#include <deque>
#include <initializer_list>
#include <vector>

#include "rig.h"
#include "urb.h"

namespace bridge_sim
{

class UrbScheduler
{
  public:
    explicit UrbScheduler(Rig &rig);

    // Without a cable it ends at once with -ENODEV.
    void submit(Urb urb);

    // The cable is in, as at first, or out: then what waits ends with -ENODEV.
    void plug(bool in);

    // Takes a waiting transfer out of its queue; it completes with -ENOENT and what it had received.
    void discard(uint64_t id);

    // One transaction (a whole transfer on the control endpoint). False: nothing to do.
    bool step();

    // Is there a transfer that the next frames can go into?
    bool bulk_waiting() const;

    // Lets the interrupt endpoint be asked once. It has nothing to say, so the caller decides how seldom that is worth
    // it.
    void poll_interrupt();

    // The host stays away from the bulk endpoint until this is called with false.
    void stay_away(bool away);

    // Polls the bulk endpoint this many times while it has nothing to give; each poll must be answered by NAK.
    void nak_storm(unsigned polls);

    // Asks the device for its status with a SETUP packet damaged on the way, which it must ignore.
    void damaged_setup();

    // A stop of the run went through on the control endpoint since the last start.
    bool stop_seen() const;

    // Transfers that ended since the last call, in order.
    std::vector<Urb> take_completed();

  private:
    bool step_control();
    bool step_bulk();
    bool step_interrupt();
    void run_control(Urb &urb);
    void watch_run(const Urb &urb);
    void watch_halt(const SetupRequest &setup);
    void bus_reset(Urb &urb);
    void complete(std::deque<Urb> &queue, int status);
    void end_all(std::initializer_list<std::deque<Urb> *> queues, int status);
    void start_afresh();
    std::deque<Urb> &queue(UrbKind kind);
    bool receive_packet();
    void bulk_answer(Outcome outcome);
    bool futile_poll();

    Rig &rig_;
    std::deque<Urb> control_;
    std::deque<Urb> bulk_;
    std::deque<Urb> interrupt_;
    std::vector<Urb> completed_;
    Bytes packet_;
    unsigned bulk_naks_ = 0; // in a row while a packet was due
    unsigned storm_left_ = 0;
    bool halted_ = false; // the bulk endpoint, by the host's own request: it answers without a frame, too
    bool interrupt_due_ = false;
    bool away_ = false;
    bool stop_seen_ = false;
    bool plugged_ = true;
};

// errno for what a transaction came to, as Linux maps it (Documentation/driver-api/usb/error-codes).
int outcome_errno(Outcome outcome);

} // namespace bridge_sim
