#include "tick_runner.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace bridge_sim
{

namespace
{

// The HID endpoint never has anything to say; the host asks every 8 ms.
constexpr uint64_t INTERRUPT_POLL_TICKS = 16;
constexpr unsigned STORM_POLLS = 200;
// 12 ms away leave 6 KiB in the bridge's 16 KiB FIFO.
constexpr uint64_t AWAY_TICKS = 24;
constexpr uint64_t BYTES_UNDER_WAY = 2 * WHISKER_LIMIT_BULK_PACKET;
// With so many bytes waiting there is room for the frame on its way and the last one.
constexpr uint64_t BYTES_WITH_ROOM = WHISKER_LIMIT_FIFO_BYTES - 2 * WHISKER_FRAME_BYTES;

bool on_link(LaneFaultKind kind)
{
    return kind == LaneFaultKind::LINK_FLIP || kind == LaneFaultKind::LINK_DEAD || kind == LaneFaultKind::LINK_STALE;
}

std::string describe(const HostCounters &counters)
{
    return std::to_string(counters.unexplained) + "; of all: " + std::to_string(counters.timeouts) + " time-outs, " +
           std::to_string(counters.crc_errors) + " CRC, " + std::to_string(counters.pid_errors) + " PID, " +
           std::to_string(counters.babbles) + " babbles, " + std::to_string(counters.duplicates) + " duplicates, " +
           std::to_string(counters.violations) + " answers out of place";
}

} // namespace

TickRunner::TickRunner(Rig &rig, UrbScheduler &scheduler, std::optional<FaultPlan> plan, FaultLog &log)
    : rig_(rig), scheduler_(scheduler), plan_(std::move(plan)), log_(log)
{
}

bool TickRunner::ready() const
{
    return away_ || (scheduler_.bulk_waiting() && rig_.frame_bytes_waiting() < BYTES_UNDER_WAY);
}

bool TickRunner::may_end() const
{
    return scheduler_.bulk_waiting() || rig_.frame_bytes_waiting() <= BYTES_WITH_ROOM;
}

void TickRunner::tick(uint64_t number, const sim_field *fields)
{
    if (plan_) {
        inject_lane_fault(number);
        inject_usb_fault(number);
        fields = inject_lasting(number, fields);
    }
    silence_dead(number);
    if (number % INTERRUPT_POLL_TICKS == 0) {
        scheduler_.poll_interrupt();
    }
    rig_.tick(fields, [this] { return scheduler_.step(); });
}

void TickRunner::last_tick(const sim_field *fields)
{
    if (in_transfer_) {
        rig_.spoil(*in_transfer_);
        in_transfer_.reset();
    }
    scheduler_.stay_away(false);
    away_ = false;
    rig_.last_tick(fields, [this] { return scheduler_.step(); });
}

void TickRunner::unplugged()
{
    in_transfer_.reset();
    away_ = false;
}

// A reading is spoilt at its own tick; its transfer comes one tick later.
void TickRunner::inject_lane_fault(uint64_t number)
{
    if (in_transfer_) {
        rig_.spoil(*in_transfer_);
        in_transfer_.reset();
    }
    const std::optional<LaneFault> fault = plan_->lane_fault(number);
    if (!fault) {
        return;
    }
    log_.lane_fault(*fault);
    if (on_link(fault->kind)) {
        in_transfer_ = fault;
    } else {
        rig_.spoil(*fault);
    }
}

void TickRunner::set_dead(size_t lane, bool dead)
{
    dead ? (void)dead_.insert({lane, 0}) : (void)dead_.erase(lane);
}

// It lasts, and the bridge sees nothing but other records: no reason for RTL.
void TickRunner::silence_dead(uint64_t number)
{
    for (auto &[lane, next_reading] : dead_) {
        if (number >= next_reading) {
            log_.lane_fault({number, lane, LaneFaultKind::SENSOR_DEAD, 0});
            next_reading = number + WHISKER_LIMIT_RESYNC_TICKS + 1;
        }
        rig_.bus().spoil_reading(lane, SIM_SENSOR_DEAD, 0);
    }
}

// Likewise. A cable is broken for the transfers of its records, each a tick later.
const sim_field *TickRunner::inject_lasting(uint64_t number, const sim_field *fields)
{
    uint32_t broken = 0;
    std::map<size_t, sim_field> frozen;
    for (const LastingFault &fault : plan_->lasting()) {
        const bool strikes = number >= fault.tick && number < fault.until;
        if (fault.kind == LastingKind::LINK_DEAD && number > fault.tick && number <= fault.until) {
            broken |= 1u << fault.lane;
        } else if (fault.kind == LastingKind::SENSOR_DEAD && strikes) {
            rig_.bus().spoil_reading(fault.lane, SIM_SENSOR_DEAD, 0);
        } else if (fault.kind == LastingKind::SENSOR_FROZEN && strikes) {
            const auto before = frozen_.find(fault.lane);
            frozen[fault.lane] = before == frozen_.end() ? fields[fault.lane] : before->second;
        }
        if (strikes) {
            log_.pair(fault.lane, number, fault_name(fault.kind));
        }
    }
    rig_.bus().cut(broken);
    frozen_.swap(frozen);
    if (frozen_.empty()) {
        return fields;
    }
    std::copy_n(fields, rig_.bus().populated(), shown_.begin());
    for (const auto &[lane, field] : frozen_) {
        shown_[lane] = field;
    }
    return shown_.data();
}

void TickRunner::inject_usb_fault(uint64_t number)
{
    if (away_ && number >= back_at_) {
        away_ = false;
        scheduler_.stay_away(false);
    }
    if (const std::optional<UsbFault> fault = plan_->usb_fault(number)) {
        log_.usb_fault(*fault);
        start_usb_fault(*fault);
    }
}

void TickRunner::start_usb_fault(const UsbFault &fault)
{
    rig_.disturbed();
    switch (fault.kind) {
    case UsbFaultKind::LOST_ACK:
        return rig_.arm(WireFault::LOST_ACK);
    case UsbFaultKind::BAD_TOKEN:
        return rig_.arm(WireFault::BAD_TOKEN);
    case UsbFaultKind::BAD_DATA:
        return rig_.arm(WireFault::BAD_DATA);
    case UsbFaultKind::BAD_SETUP:
        return scheduler_.damaged_setup();
    case UsbFaultKind::NAK_STORM:
        return scheduler_.nak_storm(STORM_POLLS);
    case UsbFaultKind::HOST_AWAY:
        away_ = true;
        back_at_ = fault.tick + AWAY_TICKS;
        return scheduler_.stay_away(true);
    }
}

void TickRunner::check_usb() const
{
    const HostCounters &counters = rig_.counters();
    const uint64_t on_wire =
        log_.usb_count() - log_.usb_count(UsbFaultKind::NAK_STORM) - log_.usb_count(UsbFaultKind::HOST_AWAY);
    if (counters.unexplained > 0) {
        throw std::runtime_error("USB irregularities that were not injected: " + describe(counters));
    }
    if (counters.injected != on_wire) {
        throw std::runtime_error("of " + std::to_string(on_wire) + " USB faults " + std::to_string(counters.injected) +
                                 " took place");
    }
}

} // namespace bridge_sim
