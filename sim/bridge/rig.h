// Bridge, nodes and USB host on one bench: runs one tick at a time, with USB transactions in between, and knows how
// many bytes of frames the FIFO must hold. There are two: the Verilated gateware with a host at packet level
// (rtl_rig.h), and that with a model of bytes for plain sampling (mixed_rig.h).
#pragma once

#include <functional>
#include <memory>

#include "fault_plan.h"
#include "flash/nor_flash.h"
#include "node_bus.h"
#include "usb_control.h"

namespace bridge_sim
{

// How much of the bridge is simulated; what comes over USB is the same. MIXED: bytes where nothing but plain sampling
// goes on, RTL else.
enum class Level { RTL, MIXED };

class Rig
{
  public:
    Rig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits);
    virtual ~Rig() = default;
    Rig(const Rig &) = delete;
    Rig &operator=(const Rig &) = delete;

    // Nodes on, bus reset, enumeration. False: `error` names the step that failed.
    bool power_on(Descriptors &descriptors, const char *&error);

    // Power goes and comes back, as when the cable is pulled and put in again; what power_on() does follows.
    bool power_cycle(Descriptors &descriptors, const char *&error);

    // What a host does to the device: bus reset with enumeration, a control transfer (usb_control.h), an IN transaction
    // of an endpoint with packets of at most `limit` bytes, a rest.
    virtual bool enumerate(Descriptors &descriptors, const char *&error) = 0;
    virtual Outcome control(const SetupRequest &request, Bytes &data) = 0;
    virtual Outcome in(uint8_t endpoint, size_t limit, Bytes &data) = 0;
    virtual void idle(uint64_t cycles) = 0;

    // Lets the next fitting transaction suffer this fault.
    virtual void arm(WireFault fault) = 0;
    virtual const HostCounters &counters() const = 0;

    NodeBus &bus();
    NorFlash &flash();
    virtual uint64_t cycles() const = 0;         // of the bridge's clock that were simulated
    virtual bool running() const = 0;            // started, and the last frame not yet in the FIFO
    virtual uint32_t frames_dropped() const = 0; // since start: the FIFO had no room for them
    virtual bool every_frame() const = 0;        // each frame ends its packet, by the settings

    // Ticks come by themselves, so packets do, too: how many bytes wait is not known, and the host asks for ever.
    virtual bool ticks_by_itself() const
    {
        return false;
    }

    // Is the present tick the registers' (RTL)?
    virtual bool at_rtl() const = 0;

    // Something but plain sampling is to come; for what does not come by one of the functions here.
    virtual void disturbed()
    {
    }

    // Spoils the reading that the next tick starts, or the transfer that the next tick makes.
    void spoil(const LaneFault &fault);

    // One tick, to the end of its transfer on the node link (the frame is made of it while the next tick's transfer
    // goes on): its readings start with these fields (one per populated lane), and meanwhile usb_step() is called again
    // and again: it makes one transaction and returns true, or returns false when the bus has nothing to do.
    void tick(const sim_field *fields, const std::function<bool()> &usb_step);

    // The tick after a stop: its transfer brings the last records, and the last frame is in the FIFO on return.
    void last_tick(const sim_field *fields, const std::function<bool()> &usb_step);

    // Frames made since the last bus reset but neither dropped nor taken yet, in bytes, and whether a bulk packet is
    // due: a full one, or the short (perhaps empty) one that ends the stream after the last frame. The caller reports
    // each packet it took.
    uint64_t frame_bytes_waiting() const;
    bool bulk_packet_due() const;
    void bulk_packet_taken(uint64_t bytes);

    // A packet that is due had better be asked for later.
    virtual bool bulk_packet_later() const;

    // A bus reset and SET_CONFIGURATION end the run and empty the FIFO: nothing waits any more.
    void forget_frames();

  protected:
    virtual void power_up() = 0;

    // A tick's SYNC and transfers, with usb_step() meanwhile. False: no tick is taken now.
    virtual bool transfer(const std::function<bool()> &usb_step) = 0;

    // How many start-of-frame packets come with a tick of this period: one every 125 us of the bridge's time, but at
    // most 16, and at least one, so that a tick's date does not hang on the cycles that were simulated before it.
    unsigned microframes(uint32_t period);

    // A packet that is due has the latest tick's frame in it, of which the bridge makes the bytes in these cycles.
    bool bulk_packet_forming() const;

    // Until the last frame is in the FIFO.
    virtual void finish_run(const std::function<bool()> &usb_step) = 0;

    NorFlash flash_;

  private:
    void count_frame();
    uint64_t newly_dropped() const;
    uint64_t bulk_packet() const; // bytes of a full one

    NodeBus bus_;
    uint64_t bus_cycles_ = 0; // since the last start-of-frame packet
    uint64_t waiting_ = 0;    // bytes; of frames dropped since the last tick it does not know yet
    uint64_t under_way_ = 0;  // of waiting_, those of the latest tick's frame
    uint32_t dropped_ = 0;    // of frames_dropped(), those that waiting_ is without
    bool ticked_ = false;     // a tick has begun since start
    bool end_due_ = false;    // the packet that ends the stream has not been taken
    bool forgot_ = false;     // in the midst of this tick
};

} // namespace bridge_sim
