#include "rig.h"

#include <algorithm>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

// A tick at the slowest settings takes some 3000 cycles, a control transfer in the midst of it as many again.
constexpr uint64_t PATIENCE_CYCLES = 1000000;

LinkFault link_fault(LaneFaultKind kind)
{
    switch (kind) {
    case LaneFaultKind::LINK_FLIP:
        return LinkFault::FLIP;
    case LaneFaultKind::LINK_DEAD:
        return LinkFault::DEAD;
    case LaneFaultKind::LINK_STALE:
        return LinkFault::STALE;
    default:
        return LinkFault::NONE;
    }
}

sim_sensor_fault sensor_fault(LaneFaultKind kind)
{
    switch (kind) {
    case LaneFaultKind::SENSOR_FLIP:
        return SIM_SENSOR_FLIP_BIT;
    case LaneFaultKind::SENSOR_DEAD:
        return SIM_SENSOR_DEAD;
    case LaneFaultKind::SENSOR_LOW:
        return SIM_SENSOR_STUCK_LOW;
    default:
        return SIM_SENSOR_ERROR_BITS;
    }
}

} // namespace

Rig::Rig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits)
    : bus_(populated, seed, traits), bridge_(bus_), host_(bridge_)
{
}

bool Rig::power_on(Descriptors &descriptors, const char *&error)
{
    bus_.power_on();
    return enumerate(host_, descriptors, error);
}

bool Rig::power_cycle(Descriptors &descriptors, const char *&error)
{
    forget_frames();
    bridge_.reset();
    return power_on(descriptors, error);
}

UsbHost &Rig::host()
{
    return host_;
}

NodeBus &Rig::bus()
{
    return bus_;
}

uint64_t Rig::cycles() const
{
    return bridge_.cycles;
}

bool Rig::running() const
{
    return bridge_.running();
}

void Rig::spoil(const LaneFault &fault)
{
    const LinkFault link = link_fault(fault.kind);
    if (link == LinkFault::NONE) {
        bus_.spoil_reading(fault.lane, sensor_fault(fault.kind), fault.argument);
    } else {
        bus_.spoil_transfer(fault.lane, link, fault.argument);
    }
}

void Rig::wait_while(const std::function<bool()> &busy, const std::function<bool()> &usb_step)
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

void Rig::tick(const sim_field *fields, const std::function<bool()> &usb_step)
{
    bus_.set_fields(fields);
    bridge_.start_tick();
    if (!bridge_.link_busy()) {
        throw std::runtime_error("the bridge ignored a tick");
    }
    host_.start_of_frame();
    wait_while([this] { return bridge_.link_busy(); }, usb_step);
    bridge_.cycle(); // the nodes see select rise
    bus_.run();
    count_frame();
}

void Rig::last_tick(const sim_field *fields, const std::function<bool()> &usb_step)
{
    tick(fields, usb_step);
    wait_while([this] { return bridge_.running(); }, usb_step);
    ticked_ = false;
    end_due_ = true;
}

// The transfer of a run's first tick brings no records, so it makes no frame.
void Rig::count_frame()
{
    if (ticked_) {
        waiting_ += WHISKER_FRAME_BYTES;
    }
    ticked_ = true;
}

uint64_t Rig::frame_bytes_waiting() const
{
    return waiting_;
}

bool Rig::bulk_packet_due() const
{
    return waiting_ >= WHISKER_LIMIT_BULK_PACKET || end_due_;
}

void Rig::bulk_packet_taken(uint64_t bytes)
{
    waiting_ -= std::min(bytes, waiting_);
    end_due_ = end_due_ && bytes == WHISKER_LIMIT_BULK_PACKET;
}

void Rig::forget_frames()
{
    waiting_ = 0;
    ticked_ = false;
    end_due_ = false;
}

} // namespace bridge_sim
