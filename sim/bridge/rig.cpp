#include "rig.h"

#include <algorithm>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr uint64_t MICROFRAME_CYCLES = WHISKER_LIMIT_CLOCK_HZ / 8000;
constexpr uint64_t MICROFRAMES_MOST = 16;

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

Rig::Rig(size_t populated, uint64_t seed, const std::vector<NodeTrait> &traits) : bus_(populated, seed, traits)
{
}

bool Rig::power_on(Descriptors &descriptors, const char *&error)
{
    bus_.power_on();
    return enumerate(descriptors, error);
}

bool Rig::power_cycle(Descriptors &descriptors, const char *&error)
{
    forget_frames();
    flash_.power_cycle();
    power_up();
    return power_on(descriptors, error);
}

NodeBus &Rig::bus()
{
    return bus_;
}

NorFlash &Rig::flash()
{
    return flash_;
}

void Rig::spoil(const LaneFault &fault)
{
    const LinkFault link = link_fault(fault.kind);
    disturbed();
    if (link == LinkFault::NONE) {
        bus_.spoil_reading(fault.lane, sensor_fault(fault.kind), fault.argument);
    } else {
        bus_.spoil_transfer(fault.lane, link, fault.argument);
    }
}

void Rig::tick(const sim_field *fields, const std::function<bool()> &usb_step)
{
    forgot_ = false;
    bus_.set_fields(fields);
    if (!transfer(usb_step)) {
        throw std::runtime_error("the bridge ignored a tick");
    }
    bus_.run();
    if (!forgot_) {
        count_frame();
    }
}

void Rig::last_tick(const sim_field *fields, const std::function<bool()> &usb_step)
{
    tick(fields, usb_step);
    finish_run(usb_step);
    ticked_ = false;
    end_due_ = true;
}

// The transfer of a run's first tick brings no records, so it makes no frame.
void Rig::count_frame()
{
    waiting_ = frame_bytes_waiting();
    dropped_ = frames_dropped();
    under_way_ = ticked_ ? WHISKER_FRAME_BYTES : 0;
    waiting_ += under_way_;
    ticked_ = true;
}

unsigned Rig::microframes(uint32_t period)
{
    bus_cycles_ += period;
    const uint64_t due = std::clamp<uint64_t>(bus_cycles_ / MICROFRAME_CYCLES, 1, MICROFRAMES_MOST);
    bus_cycles_ %= MICROFRAME_CYCLES;
    return static_cast<unsigned>(due);
}

// The bridge counts anew from each start.
uint64_t Rig::newly_dropped() const
{
    const uint32_t count = frames_dropped();
    return count < dropped_ ? count : count - dropped_;
}

uint64_t Rig::frame_bytes_waiting() const
{
    return waiting_ - std::min(newly_dropped() * WHISKER_FRAME_BYTES, waiting_);
}

uint64_t Rig::bulk_packet() const
{
    return every_frame() ? WHISKER_FRAME_BYTES : WHISKER_LIMIT_BULK_PACKET;
}

bool Rig::bulk_packet_due() const
{
    return frame_bytes_waiting() >= bulk_packet() || end_due_;
}

bool Rig::bulk_packet_forming() const
{
    return frame_bytes_waiting() < bulk_packet() + under_way_ && !end_due_;
}

bool Rig::bulk_packet_later() const
{
    return false;
}

void Rig::bulk_packet_taken(uint64_t bytes)
{
    waiting_ -= std::min(bytes, waiting_);
    end_due_ = end_due_ && bytes == WHISKER_LIMIT_BULK_PACKET;
}

void Rig::forget_frames()
{
    waiting_ = under_way_ = 0;
    dropped_ = frames_dropped();
    ticked_ = false;
    end_due_ = false;
    forgot_ = true;
}

} // namespace bridge_sim
