#include "fault_plan.h"

#include <algorithm>
#include <array>

#include "whisker_protocol.h"

namespace bridge_sim
{

namespace
{

// A block's first and last ticks stay free: a stale record needs a good one before it, an away host time to return.
constexpr uint64_t BLOCK_MARGIN = 32;
// Ticks before the end of the run that stay free, so that each fault's records are still delivered.
constexpr uint64_t END_MARGIN = 4;
// Streams of random numbers that one seed is split into.
constexpr uint64_t LANE_STREAM = 0x6C616E65;
constexpr uint64_t USB_STREAM = 0x00757362;

constexpr std::array<unsigned, 10> SENSOR_BITS = {
#define WHISKER_SENSOR_BIT(name, bit, sensor_bit, cause, remedy) sensor_bit,
    WHISKER_SENSOR_ERRORS(WHISKER_SENSOR_BIT)
#undef WHISKER_SENSOR_BIT
};

// Bits of a sensor frame, eight bytes. A flipped bit of the error word (sixth and seventh byte) can pass for a sensor's
// own error; that case is SENSOR_ERROR's, so flips leave these two bytes out.
constexpr unsigned SENSOR_FRAME_BITS = 64;
constexpr unsigned ERROR_WORD_FIRST = 40;
constexpr unsigned ERROR_WORD_BITS = 16;
constexpr unsigned LINK_BITS = 8 * WHISKER_RECORD_BYTES;

unsigned sensor_flip_bit(uint64_t value)
{
    const auto bit = static_cast<unsigned>(value % (SENSOR_FRAME_BITS - ERROR_WORD_BITS));
    return bit < ERROR_WORD_FIRST ? bit : bit + ERROR_WORD_BITS;
}

// The last of a list, if its tick has come; then it is gone from there.
template <typename Fault> std::optional<Fault> take(std::vector<Fault> &list, uint64_t tick)
{
    if (list.empty() || list.back().tick != tick) {
        return std::nullopt;
    }
    const Fault fault = list.back();
    list.pop_back();
    return fault;
}

} // namespace

const char *fault_name(LaneFaultKind kind)
{
    static const std::array<const char *, LANE_FAULT_KINDS> names = {
        "sensor_flip", "sensor_dead", "sensor_low", "sensor_error", "link_flip", "link_dead", "link_stale"};
    return names[static_cast<unsigned>(kind)];
}

const char *fault_name(UsbFaultKind kind)
{
    static const std::array<const char *, USB_FAULT_KINDS> names = {"lost_ack",  "bad_token", "bad_data",
                                                                    "bad_setup", "nak_storm", "host_away"};
    return names[static_cast<unsigned>(kind)];
}

const char *fault_name(LastingKind kind)
{
    static const std::array<const char *, LASTING_KINDS> names = {"sensor_dead", "sensor_frozen", "link_dead"};
    return names[static_cast<unsigned>(kind)];
}

bool costs_resync(LaneFaultKind kind)
{
    return kind == LaneFaultKind::SENSOR_FLIP || kind == LaneFaultKind::SENSOR_DEAD ||
           kind == LaneFaultKind::SENSOR_LOW;
}

FaultPlan::FaultPlan(uint64_t seed, size_t lanes, uint64_t last_tick)
    : lane_generator_(seed ^ LANE_STREAM << 32), usb_generator_(seed ^ USB_STREAM << 32), lanes_(lanes),
      end_(last_tick > END_MARGIN ? last_tick - END_MARGIN : 0), next_lane_(draw_lane_fault(0)),
      next_usb_(draw_usb_fault(0))
{
}

FaultPlan::FaultPlan(std::vector<LaneFault> lane_faults, std::vector<UsbFault> usb_faults,
                     std::vector<LastingFault> lasting)
    : given_(true), lane_list_(std::move(lane_faults)), usb_list_(std::move(usb_faults)), lasting_(std::move(lasting))
{
    std::reverse(lane_list_.begin(), lane_list_.end());
    std::reverse(usb_list_.begin(), usb_list_.end());
}

const std::vector<LastingFault> &FaultPlan::lasting() const
{
    return lasting_;
}

// Not a standard distribution: those may differ from one C++ library to the next.
uint64_t FaultPlan::draw(std::mt19937_64 &generator, uint64_t bound)
{
    return generator() % bound;
}

unsigned FaultPlan::draw_argument(LaneFaultKind kind)
{
    const uint64_t value = lane_generator_();
    switch (kind) {
    case LaneFaultKind::SENSOR_FLIP:
        return sensor_flip_bit(value);
    case LaneFaultKind::SENSOR_ERROR:
        return 1u << SENSOR_BITS[value % SENSOR_BITS.size()];
    default:
        return static_cast<unsigned>(value % LINK_BITS);
    }
}

LaneFault FaultPlan::draw_lane_fault(uint64_t block)
{
    const uint64_t offset = draw(lane_generator_, LANE_FAULT_BLOCK - 2 * BLOCK_MARGIN);
    const size_t lane = draw(lane_generator_, lanes_);
    const auto kind = static_cast<LaneFaultKind>(draw(lane_generator_, LANE_FAULT_KINDS));
    return {block * LANE_FAULT_BLOCK + BLOCK_MARGIN + offset, lane, kind, draw_argument(kind)};
}

UsbFault FaultPlan::draw_usb_fault(uint64_t block)
{
    const uint64_t offset = draw(usb_generator_, USB_FAULT_BLOCK - 2 * BLOCK_MARGIN);
    // In turn, so that even a short run sees every kind.
    return {block * USB_FAULT_BLOCK + BLOCK_MARGIN + offset, static_cast<UsbFaultKind>(block % USB_FAULT_KINDS)};
}

std::optional<LaneFault> FaultPlan::lane_fault(uint64_t tick)
{
    if (given_) {
        return take(lane_list_, tick);
    }
    const LaneFault fault = next_lane_;
    if (tick != fault.tick || tick >= end_) {
        return std::nullopt;
    }
    next_lane_ = draw_lane_fault(tick / LANE_FAULT_BLOCK + 1);
    return fault;
}

std::optional<UsbFault> FaultPlan::usb_fault(uint64_t tick)
{
    if (given_) {
        return take(usb_list_, tick);
    }
    const UsbFault fault = next_usb_;
    if (tick != fault.tick || tick >= end_) {
        return std::nullopt;
    }
    next_usb_ = draw_usb_fault(tick / USB_FAULT_BLOCK + 1);
    return fault;
}

} // namespace bridge_sim
