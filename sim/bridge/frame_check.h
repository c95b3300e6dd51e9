// Reads frames out of the bulk stream and checks everything the wire format promises: CRCs, order, lanes.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>

#include "usb_packet.h"
#include "whisker_protocol.h"

namespace bridge_sim
{

struct CheckedRecord {
    uint8_t tick;
    uint16_t alpha;
    uint16_t beta;
    uint16_t status;
};

struct CheckedFrame {
    uint32_t tick;
    uint64_t time;
    uint32_t sequence;
    uint32_t dropped;
    uint32_t lane_mask;
    uint8_t flags;
    std::array<CheckedRecord, WHISKER_LIMIT_LANES> lane;
};

class FrameCheck
{
  public:
    // on_frame: called with every frame that passes. tick_period: cycles from tick to tick.
    explicit FrameCheck(std::function<void(const CheckedFrame &)> on_frame,
                        uint32_t tick_period = WHISKER_LIMIT_TICK_PERIOD);

    // The next bytes of the stream. Throws std::runtime_error with one line that names the frame and what is wrong.
    void take(const Bytes &bytes);

    // Frames of this run so far, and whether the last of a run was among them.
    uint64_t frames() const;
    bool ended() const;

    // A run begins: its first frame is tick 0. The sequence number goes on; after a bus reset only from where the
    // bridge had got to, for it throws away what was not taken.
    void expect_start(bool after_reset);

  private:
    void check(const uint8_t *frame);
    void check_order(const CheckedFrame &frame);

    std::function<void(const CheckedFrame &)> on_frame_;
    uint32_t tick_period_;
    Bytes pending_;
    uint64_t frames_ = 0;
    uint32_t next_tick_ = 0;
    uint32_t next_sequence_ = 0;
    bool sequence_known_ = false;
    bool ended_ = false;
};

} // namespace bridge_sim
