// Bridge, nodes and USB host on one bench: runs one tick at a time, with USB transactions and the node link's transfer
// interleaved cycle by cycle, and knows how many bytes of frames the FIFO must hold.
#pragma once

#include <functional>

#include "bridge_model.h"
#include "fault_plan.h"
#include "usb_control.h"

namespace bridge_sim
{

class Rig
{
  public:
    Rig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits = {});

    // Nodes on, bus reset, enumeration. False: `error` names the step that failed.
    bool power_on(Descriptors &descriptors, const char *&error);

    // Power goes and comes back, as when the cable is pulled and put in again; what power_on() does follows.
    bool power_cycle(Descriptors &descriptors, const char *&error);

    UsbHost &host();
    NodeBus &bus();
    uint64_t cycles() const;
    bool running() const; // started, and the last frame not yet in the FIFO

    // Spoils the reading that the next tick starts, or the transfer that the next tick makes.
    void spoil(const LaneFault &fault);

    // One tick, to the end of its transfer on the node link (the frame is made of it while the next tick's transfer
    // goes on): its readings start with these fields (one per populated lane), and meanwhile usb_step() is called again
    // and again: it makes one transaction and returns true, or returns false when the bus has nothing to do.
    void tick(const sim_field *fields, const std::function<bool()> &usb_step);

    // The tick after a stop: its transfer brings the last records, and the last frame is in the FIFO on return.
    void last_tick(const sim_field *fields, const std::function<bool()> &usb_step);

    // Frames made since the last bus reset but not yet taken, in bytes, and whether a bulk packet is due: a full one,
    // or the short (perhaps empty) one that ends the stream after the last frame. The caller reports each packet it
    // took.
    uint64_t frame_bytes_waiting() const;
    bool bulk_packet_due() const;
    void bulk_packet_taken(uint64_t bytes);

    // A bus reset and SET_CONFIGURATION end the run and empty the FIFO: nothing waits any more.
    void forget_frames();

  private:
    void count_frame();
    void wait_while(const std::function<bool()> &busy, const std::function<bool()> &usb_step);

    NodeBus bus_;
    BridgeModel bridge_;
    UsbHost host_;
    uint64_t waiting_ = 0;
    bool ticked_ = false;  // a tick has begun since start
    bool end_due_ = false; // the packet that ends the stream has not been taken
};

} // namespace bridge_sim
