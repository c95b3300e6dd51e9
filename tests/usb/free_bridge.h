// The whole bridge as on a board: ticks of its own, a start-of-frame packet every 125 us, a host that asks for ever.
// When does each SYNC come, and how much later is its frame on the host?
#pragma once

#include <vector>

#include "bridge_model.h"

namespace bridge_sim
{

struct FreeSettings {
    uint8_t sck_divider = WHISKER_LIMIT_SCK_DIVIDER_DEFAULT;
    uint8_t word_gap = WHISKER_LIMIT_WORD_GAP_DEFAULT;
    uint8_t options = 0; // bits of control_options
    uint32_t tick_period = WHISKER_LIMIT_TICK_PERIOD;
    uint64_t rest = 0; // cycles that the host rests after each transaction
};

// In cycles of 60 MHz.
struct FreeRun {
    std::vector<uint64_t> syncs;   // when SYNC rose
    std::vector<uint64_t> packets; // by frame: from its SYNC until the packet with its last byte was acknowledged
    std::vector<uint64_t> dates;   // by frame: usb_time of its header
    std::vector<uint64_t> host;    // by SYNC: microframes that the host had begun
    uint64_t bad = 0;              // records of settled nodes that were not good

    // From SYNC until a transfer of `batch` frames has ended that holds the frame; a short packet ends one.
    std::vector<uint64_t> transfers(size_t batch) const;

    std::vector<size_t> sizes; // of the packets, in order
    std::vector<size_t> last;  // by frame: the packet with its last byte
};

// A run of so many ticks. Throws std::runtime_error with one line if a frame is missing.
FreeRun run_free(const FreeSettings &settings, uint64_t ticks);

} // namespace bridge_sim
