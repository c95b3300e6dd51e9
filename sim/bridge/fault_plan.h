// Which fault strikes when, drawn from the seed alone or given as a list: lane faults (sensor, SPI link) and USB
// faults. Pure data.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

namespace bridge_sim
{

// Draws per simulated time: one lane fault in every 1000 ticks and one USB fault in every 2000.
constexpr uint64_t LANE_FAULT_BLOCK = 1000;
constexpr uint64_t USB_FAULT_BLOCK = 2000;

enum class LaneFaultKind { SENSOR_FLIP, SENSOR_DEAD, SENSOR_LOW, SENSOR_ERROR, LINK_FLIP, LINK_DEAD, LINK_STALE };
constexpr unsigned LANE_FAULT_KINDS = 7;

struct LaneFault {
    uint64_t tick; // of the record that is lost or marked
    size_t lane;
    LaneFaultKind kind;
    unsigned argument; // bit number, or the sensor's error word
};

enum class UsbFaultKind { LOST_ACK, BAD_TOKEN, BAD_DATA, BAD_SETUP, NAK_STORM, HOST_AWAY };
constexpr unsigned USB_FAULT_KINDS = 6;

struct UsbFault {
    uint64_t tick;
    UsbFaultKind kind;
};

// What lasts. The bridge sees nothing but other records.
enum class LastingKind { SENSOR_DEAD, SENSOR_FROZEN, LINK_DEAD };
constexpr unsigned LASTING_KINDS = 3;

struct LastingFault {
    uint64_t tick, until; // of the first record, and of the first one that is well again
    size_t lane;
    LastingKind kind;
};

const char *fault_name(LaneFaultKind kind);
const char *fault_name(LastingKind kind);
const char *fault_name(UsbFaultKind kind);

// A sensor frame that does not pass its checks costs this record and the next (resynchronisation).
bool costs_resync(LaneFaultKind kind);

// Draws one event per block of ticks, somewhere in the block's middle part, so that two never overlap.
class FaultPlan
{
  public:
    // lanes: populated ones. last_tick: no fault at or after it minus a margin, so that each can be reported.
    FaultPlan(uint64_t seed, size_t lanes, uint64_t last_tick);

    // These and no others; each list by rising tick.
    FaultPlan(std::vector<LaneFault> lane_faults, std::vector<UsbFault> usb_faults,
              std::vector<LastingFault> lasting = {});

    // Those that last, in no order.
    const std::vector<LastingFault> &lasting() const;

    // The fault of this tick, if any. Ticks must be asked for in rising order, each at most once per kind of fault.
    std::optional<LaneFault> lane_fault(uint64_t tick);
    std::optional<UsbFault> usb_fault(uint64_t tick);

  private:
    uint64_t draw(std::mt19937_64 &generator, uint64_t bound);
    LaneFault draw_lane_fault(uint64_t block);
    unsigned draw_argument(LaneFaultKind kind);
    UsbFault draw_usb_fault(uint64_t block);

    bool given_ = false;
    std::vector<LaneFault> lane_list_; // given ones still to come, the next one last
    std::vector<UsbFault> usb_list_;
    std::vector<LastingFault> lasting_;
    std::mt19937_64 lane_generator_;
    std::mt19937_64 usb_generator_;
    size_t lanes_ = 0;
    uint64_t end_ = 0;
    LaneFault next_lane_{};
    UsbFault next_usb_{};
};

} // namespace bridge_sim
