#include "frame_check.h"

#include <sstream>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

CheckedRecord read_record(const uint8_t *at)
{
    return {at[WHISKER_RECORD_TICK], whisker_get_u16(at + WHISKER_RECORD_ALPHA),
            whisker_get_u16(at + WHISKER_RECORD_BETA), whisker_get_u16(at + WHISKER_RECORD_STATUS)};
}

CheckedFrame read_frame(const uint8_t *at)
{
    CheckedFrame frame{};
    frame.tick = whisker_get_u32(at + WHISKER_FRAME_HEADER_TICK);
    frame.time = whisker_get_u64(at + WHISKER_FRAME_HEADER_TIME);
    frame.sequence = whisker_get_u32(at + WHISKER_FRAME_HEADER_SEQUENCE);
    frame.dropped = whisker_get_u32(at + WHISKER_FRAME_HEADER_DROPPED);
    frame.lane_mask = whisker_get_u32(at + WHISKER_FRAME_HEADER_LANE_MASK);
    frame.flags = at[WHISKER_FRAME_HEADER_FLAGS];
    for (size_t lane = 0; lane < frame.lane.size(); lane++) {
        frame.lane[lane] = read_record(at + WHISKER_FRAME_HEADER_BYTES + lane * WHISKER_RECORD_BYTES);
    }
    return frame;
}

// The words of `what` are put together only if something is wrong: this is asked of every record.
template <typename... Words> void require(bool ok, uint64_t frame, const Words &...what)
{
    if (!ok) {
        std::ostringstream text;
        text << "frame " << frame << ": ";
        (text << ... << what);
        throw std::runtime_error(text.str());
    }
}

void check_constants(const uint8_t *at, uint64_t number)
{
    require(whisker_get_u16(at) == WHISKER_LIMIT_FRAME_MAGIC, number, "does not begin with the magic number");
    require(at[WHISKER_FRAME_HEADER_WIRE_VERSION] == WHISKER_WIRE_VERSION, number, "has another wire version");
    require(at[WHISKER_FRAME_HEADER_LANES] == WHISKER_LIMIT_LANES, number, "has another number of lanes");
    require(whisker_crc8(at, WHISKER_FRAME_HEADER_CRC) == at[WHISKER_FRAME_HEADER_CRC], number, "header CRC is wrong");
}

void check_records(const uint8_t *at, uint64_t number)
{
    for (size_t lane = 0; lane < WHISKER_LIMIT_LANES; lane++) {
        const uint8_t *record = at + WHISKER_FRAME_HEADER_BYTES + lane * WHISKER_RECORD_BYTES;
        require(whisker_crc8(record, WHISKER_RECORD_CRC) == record[WHISKER_RECORD_CRC], number, "record CRC of lane ",
                lane, " is wrong");
        require(record[WHISKER_RECORD_TICK] == at[WHISKER_FRAME_HEADER_TICK], number, "record of lane ", lane,
                " carries another tick");
    }
}

} // namespace

FrameCheck::FrameCheck(std::function<void(const CheckedFrame &)> on_frame, uint32_t tick_period)
    : on_frame_(std::move(on_frame)), tick_period_(tick_period)
{
}

uint64_t FrameCheck::frames() const
{
    return frames_;
}

bool FrameCheck::ended() const
{
    return ended_;
}

void FrameCheck::expect_start(bool after_reset)
{
    sequence_known_ = sequence_known_ && !after_reset;
    frames_ = 0;
    next_tick_ = 0;
    ended_ = false;
    pending_.clear();
}

void FrameCheck::take(const Bytes &bytes)
{
    pending_.insert(pending_.end(), bytes.begin(), bytes.end());
    size_t at = 0;
    for (; pending_.size() - at >= WHISKER_FRAME_BYTES; at += WHISKER_FRAME_BYTES) {
        check(pending_.data() + at);
    }
    pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(at));
}

void FrameCheck::check(const uint8_t *bytes)
{
    check_constants(bytes, frames_);
    check_records(bytes, frames_);
    const CheckedFrame frame = read_frame(bytes);
    check_order(frame);
    frames_++;
    on_frame_(frame);
}

void FrameCheck::check_order(const CheckedFrame &frame)
{
    require(!ended_, frames_, "comes after the last frame of its run");
    require(frame.tick == next_tick_, frames_, "is tick ", frame.tick, " instead of ", next_tick_);
    require(frame.time == uint64_t{tick_period_} * frame.tick, frames_, "has a wrong time");
    require(!sequence_known_ || frame.sequence == next_sequence_, frames_, "has sequence ", frame.sequence,
            " instead of ", next_sequence_);
    require(frame.dropped == 0, frames_, "reports dropped frames");
    next_tick_ = frame.tick + 1;
    next_sequence_ = frame.sequence + 1;
    sequence_known_ = true;
    ended_ = (frame.flags & WHISKER_FRAME_FLAG_LAST) != 0;
}

} // namespace bridge_sim
