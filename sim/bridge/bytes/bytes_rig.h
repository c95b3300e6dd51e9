// Level bytes: the bridge and its USB device without a clock. A tick begins, the host makes its transactions, and then
// the nodes' records are taken whole.
#pragma once

#include "bytes_device.h"
#include "rig.h"

namespace bridge_sim
{

class BytesRig : public Rig
{
  public:
    BytesRig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits);

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

    // Start-of-frame packets up to this microframe of the host's, without a tick: it may have other devices.
    void wait_until(uint64_t microframe);

  protected:
    void power_up() override;
    bool transfer(const std::function<bool()> &usb_step) override;
    void finish_run(const std::function<bool()> &usb_step) override;

  private:
    BytesBridge bridge_;
    BytesDevice device_;
    uint64_t microframe_ = 0; // of the host
};

} // namespace bridge_sim
