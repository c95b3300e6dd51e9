// What plain sampling depends on, and what a tick of it changes in the bridge besides its FIFO and the bulk endpoint:
// carried over from one level of detail to the other.
#pragma once

#include <cstdint>

namespace bridge_sim
{

struct SamplingSettings {
    uint8_t options; // bits of control_options
    uint32_t lane_mask;
    uint32_t tick_period; // cycles of 60 MHz
};

struct SamplingState {
    uint32_t number;                  // of the latest tick
    uint64_t time, before;            // cycles from tick 0 to the latest tick, and to the one before
    uint16_t usb_frame;               // of the latest start-of-frame packet
    uint8_t usb_microframe;           // .
    uint16_t usb_time;                // of the latest tick
    uint16_t usb_time_before;         // of the one before
    uint32_t ticks, frames, dropped;  // since start
    uint32_t sequence;                // since power-up
    uint32_t good, absent, crc, tick; // records, likewise
};

} // namespace bridge_sim
