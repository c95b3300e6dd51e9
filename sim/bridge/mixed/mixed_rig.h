// Levels mixed in one run, by need. Registers stand still while nothing but plain sampling goes on: the model of bytes
// makes the frames meanwhile. Before anything else is asked of the bridge (a control transfer, a fault, a host that
// does not read) the registers go on from where that last stood with no frame under way, and make the ticks since then
// once more, of the same records: their packets must be the same.
#pragma once

#include "bytes_model.h"
#include "rtl_rig.h"

namespace bridge_sim
{

class MixedRig : public RtlRig
{
  public:
    // The first `rtl_ticks` ticks are made by the registers.
    MixedRig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits, uint64_t rtl_ticks);

    bool enumerate(Descriptors &descriptors, const char *&error) override;
    Outcome control(const SetupRequest &request, Bytes &data) override;
    Outcome in(uint8_t endpoint, size_t limit, Bytes &data) override;
    void arm(WireFault fault) override;
    bool at_rtl() const override;

    // Throws std::runtime_error if the registers make other packets of the ticks since then.
    void disturbed() override;

  protected:
    void power_up() override;
    bool transfer(const std::function<bool()> &usb_step) override;

  private:
    struct Tick {
        unsigned microframes; // start-of-frame packets that came with it
        std::array<uint64_t, LANES> records;
    };

    struct Again {
        size_t packets = 0;           // taken again
        uint64_t made = 0, taken = 0; // bytes
    };

    bool try_bytes(const std::function<bool()> &usb_step);
    bool before_tick(const std::function<bool()> &goes_on, const std::function<bool()> &usb_step);
    bool finish_tick(const std::function<bool()> &usb_step);
    void mark();
    bool byte_tick(const std::function<bool()> &usb_step);
    void back_to_registers();
    void make_again(const Tick &tick, Again &again);
    bool take_again(Again &again);

    BytesModel bytes_;
    bool at_bytes_ = false;
    bool before_tick_ = false;  // what the host asks for is of a tick that has not started
    bool begun_ = false;        // the registers started that tick
    uint64_t rtl_ticks_;        // still to come
    uint64_t quiet_ = 0;        // ticks since anything but sampling went on
    uint64_t microframe_ = 0;   // of the host, in the model
    SamplingState marked_{};    // where the registers go on
    uint64_t marked_frame_ = 0; // the host's microframe then
    std::vector<Tick> ticks_;   // since then
    std::vector<Bytes> taken_;  // packets since then
};

} // namespace bridge_sim
