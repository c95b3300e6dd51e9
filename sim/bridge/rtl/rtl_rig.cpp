#include "rtl_rig.h"

#include <stdexcept>

namespace bridge_sim
{

namespace
{

// A tick at the slowest settings takes some 3000 cycles, a control transfer in the midst of it as many again.
constexpr uint64_t PATIENCE_CYCLES = 1000000;

} // namespace

RtlRig::RtlRig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits)
    : Rig(populated, seed, traits), bridge_(bus(), flash_), host_(bridge_)
{
}

bool RtlRig::enumerate(Descriptors &descriptors, const char *&error)
{
    return bridge_sim::enumerate(host_, descriptors, error);
}

Outcome RtlRig::control(const SetupRequest &request, Bytes &data)
{
    return control_transfer(host_, request, data);
}

Outcome RtlRig::in(uint8_t endpoint, size_t limit, Bytes &data)
{
    return host_.in(endpoint, limit, data);
}

void RtlRig::idle(uint64_t cycles)
{
    host_.idle(cycles);
}

void RtlRig::arm(WireFault fault)
{
    host_.arm(fault);
}

const HostCounters &RtlRig::counters() const
{
    return host_.counters();
}

uint64_t RtlRig::cycles() const
{
    return bridge_.cycles;
}

bool RtlRig::running() const
{
    return bridge_.running();
}

bool RtlRig::every_frame() const
{
    return bridge_.every_frame();
}

bool RtlRig::at_rtl() const
{
    return true;
}

uint32_t RtlRig::frames_dropped() const
{
    return bridge_.frames_dropped();
}

void RtlRig::power_up()
{
    bridge_.reset();
}

bool RtlRig::transfer(const std::function<bool()> &usb_step)
{
    if (!begin_tick()) {
        return false;
    }
    end_tick(usb_step);
    return true;
}

bool RtlRig::begin_tick()
{
    const unsigned frames = microframes(bridge_.tick_period());
    host_.start_of_frame();
    bridge_.start_tick();
    bridge_.cycle();
    if (!bridge_.link_busy()) {
        return false;
    }
    for (unsigned i = 1; i < frames; i++) {
        host_.start_of_frame();
    }
    return true;
}

void RtlRig::end_tick(const std::function<bool()> &usb_step)
{
    in_transfer_ = true;
    wait_while([this] { return bridge_.link_busy(); }, usb_step);
    in_transfer_ = false;
}

// A packet takes as many cycles as a transfer does. Begun when its last byte is there, it would outlast this transfer
// by half; begun with the next one, both are over at the same time.
bool RtlRig::bulk_packet_later() const
{
    return in_transfer_ && bulk_packet_forming() && !every_frame();
}

void RtlRig::finish_run(const std::function<bool()> &usb_step)
{
    wait_while([this] { return bridge_.running(); }, usb_step);
}

void RtlRig::wait_while(const std::function<bool()> &busy, const std::function<bool()> &usb_step)
{
    const uint64_t limit = bridge_.cycles + PATIENCE_CYCLES;
    while (busy()) {
        if (!usb_step()) {
            bridge_.cycle();
        }
        if (bridge_.cycles > limit) {
            throw std::runtime_error("the bridge did not finish a tick");
        }
    }
}

} // namespace bridge_sim
