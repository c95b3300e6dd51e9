#include "bytes_rig.h"

#include <stdexcept>

namespace bridge_sim
{

BytesRig::BytesRig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits)
    : Rig(populated, seed, traits), bridge_(bus(), flash_), device_(bridge_)
{
}

bool BytesRig::enumerate(Descriptors &descriptors, const char *&error)
{
    device_.bus_reset();
    const auto transfer = [this](const SetupRequest &request, Bytes &data) { return control(request, data); };
    return configure(transfer, descriptors, error);
}

Outcome BytesRig::control(const SetupRequest &request, Bytes &data)
{
    return device_.control(request, data);
}

// No packet is longer than the endpoint's, so the limit is kept.
Outcome BytesRig::in(uint8_t endpoint, size_t, Bytes &data)
{
    return device_.in(endpoint, data);
}

void BytesRig::idle(uint64_t)
{
}

void BytesRig::arm(WireFault fault)
{
    device_.arm(fault);
}

const HostCounters &BytesRig::counters() const
{
    return device_.counters();
}

uint64_t BytesRig::cycles() const
{
    return 0;
}

bool BytesRig::running() const
{
    return bridge_.running();
}

bool BytesRig::every_frame() const
{
    return bridge_.every_frame();
}

bool BytesRig::at_rtl() const
{
    return false;
}

uint32_t BytesRig::frames_dropped() const
{
    return bridge_.frames_dropped();
}

void BytesRig::power_up()
{
    device_.power_up();
}

void BytesRig::wait_until(uint64_t microframe)
{
    while (microframe_ < microframe) {
        bridge_.start_of_frame(microframe_++);
    }
}

bool BytesRig::transfer(const std::function<bool()> &usb_step)
{
    const unsigned frames = microframes(bridge_.tick_period());
    bridge_.start_of_frame(microframe_++);
    if (!bridge_.begin_tick()) {
        return false;
    }
    for (unsigned i = 1; i < frames; i++) {
        bridge_.start_of_frame(microframe_++);
    }
    while (usb_step()) {
    }
    bridge_.end_tick();
    return true;
}

void BytesRig::finish_run(const std::function<bool()> &usb_step)
{
    while (bridge_.running()) {
        if (!usb_step()) {
            throw std::runtime_error("the last frame waits for room, and the host does not read");
        }
    }
}

} // namespace bridge_sim
