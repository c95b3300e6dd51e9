// The Verilated bridge and a host at packet level: a tick goes cycle by cycle, and USB transactions share the cycles.
#pragma once

#include "bridge_model.h"
#include "rig.h"

namespace bridge_sim
{

class RtlRig : public Rig
{
  public:
    RtlRig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits);

    bool enumerate(Descriptors &descriptors, const char *&error) override;
    Outcome control(const SetupRequest &request, Bytes &data) override;
    Outcome in(uint8_t endpoint, size_t limit, Bytes &data) override;
    void idle(uint64_t cycles) override;
    void arm(WireFault fault) override;
    const HostCounters &counters() const override;
    uint64_t cycles() const override;
    bool running() const override;
    uint32_t frames_dropped() const override;
    bool every_frame() const override;
    bool at_rtl() const override;
    bool bulk_packet_later() const override;

  protected:
    void power_up() override;
    bool transfer(const std::function<bool()> &usb_step) override;
    void finish_run(const std::function<bool()> &usb_step) override;

    // The two halves of a transfer: its start (false: no tick is taken now), and what is left of it.
    bool begin_tick();
    void end_tick(const std::function<bool()> &usb_step);

    BridgeModel bridge_;
    UsbHost host_;

  private:
    bool in_transfer_ = false;

    void wait_while(const std::function<bool()> &busy, const std::function<bool()> &usb_step);
};

} // namespace bridge_sim
