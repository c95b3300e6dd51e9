// The whole bridge on ticks of its own, as on a board, or with a tick asked for every so many cycles, whatever the host
// does meanwhile; nodes on all lanes, a start-of-frame packet every 125 us, a host that asks for ever. When does each
// SYNC come, how much later is its frame on the host, and how fast can it go?
#pragma once

#include <vector>

#include "bridge_model.h"

namespace bridge_sim
{

struct RunSettings {
    uint8_t sck_divider = WHISKER_LIMIT_SCK_DIVIDER_DEFAULT;
    uint8_t word_gap = WHISKER_LIMIT_WORD_GAP_DEFAULT;
    uint8_t options = 0; // bits of control_options
    uint32_t tick_period = WHISKER_LIMIT_TICK_PERIOD;
    uint64_t asked_every = 0; // cycles from tick to tick that are asked for from outside; 0: ticks of its own

    // The nodes' bus at its fastest.
    static RunSettings fastest();
};

// In cycles of 60 MHz.
struct BridgeRun {
    std::vector<uint64_t> syncs;   // when SYNC rose
    std::vector<uint64_t> packets; // by frame: from its SYNC until the packet with its last byte was acknowledged
    std::vector<uint64_t> dates;   // by frame: usb_time of its header
    std::vector<uint64_t> host;    // by SYNC: microframes that the host had begun
    uint64_t bad = 0;              // records of settled nodes that were not good

    // From SYNC until a transfer of `batch` frames has ended that holds the frame; a short packet ends one.
    std::vector<uint64_t> transfers(size_t batch) const;

    // Has every one of so many ticks become a frame, with good records?
    bool sustained(uint64_t ticks) const;

    std::vector<size_t> sizes; // of the packets, in order
    std::vector<size_t> last;  // by frame: the packet with its last byte
};

// A run of so many ticks. Throws std::runtime_error with one line if a frame is missing among those read.
BridgeRun run_bridge(const RunSettings &settings, uint64_t ticks);

} // namespace bridge_sim
