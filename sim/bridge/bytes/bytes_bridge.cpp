#include "bytes_bridge.h"

#include <algorithm>

namespace bridge_sim
{

namespace
{

constexpr unsigned USB_TIME_KNOWN = 0x8000;

} // namespace

BytesBridge::BytesBridge(NodeBus &bus, NorFlash &flash)
    : bus_(bus), flash_(flash), flash_body_(WHISKER_REPORT_FLASH_BYTES - WHISKER_REPORT_FLASH_ADDRESS)
{
    power_up();
}

// The tick of the service order before outlives it, as its register has no reset.
void BytesBridge::power_up()
{
    settings_ = LinkSettings();
    counters_ = Counters();
    windows_ = 0;
    usb_known_ = false;
    usb_time_ = usb_time_before_ = 0;
    halt();
}

void BytesBridge::halt()
{
    stream_.clear();
    run_ = running_ = stopping_ = finishing_ = ticked_ = in_tick_ = false;
    order_.clear();
    answer_verdicts_.fill(WHISKER_CODE_ABSENT);
}

bool BytesBridge::running() const
{
    return running_;
}

uint32_t BytesBridge::frames_dropped() const
{
    return counters_.dropped;
}

bool BytesBridge::every_frame() const
{
    return settings_.options & WHISKER_CONTROL_OPTION_EVERY_FRAME;
}

uint32_t BytesBridge::tick_period() const
{
    return settings_.tick_period;
}

// As sof_clock.v counts: a packet with the number of the one before is the next eighth.
void BytesBridge::start_of_frame(uint64_t microframe)
{
    const auto frame = static_cast<uint16_t>(microframe / 8 % 2048);
    usb_microframe_ = usb_known_ && frame == usb_frame_ ? (usb_microframe_ + 1u) % 8 : 0;
    usb_frame_ = frame;
    usb_known_ = true;
}

// ------------------------------------------------------------------------------------------------------------ ticks

bool BytesBridge::begin_tick()
{
    if (!running_ || finishing_ || (stopping_ && !ticked_)) {
        return false;
    }
    first_ = !ticked_;
    number_ = first_ ? 0 : number_ + 1;
    before_ = time_;
    time_ = first_ ? 0 : time_ + settings_.tick_period;
    usb_time_before_ = usb_time_;
    usb_time_ = usb_known_ ? static_cast<uint16_t>(USB_TIME_KNOWN | usb_frame_ << 3 | usb_microframe_) : 0;
    finishing_ = stopping_;
    ticked_ = in_tick_ = true;
    pattern_ = settings_.options & WHISKER_CONTROL_OPTION_PATTERN;
    service_ = !order_.empty() && settings_.service_fits();
    counters_.ticks++;
    link_sync(bus_);
    return true;
}

void BytesBridge::end_tick()
{
    if (!in_tick_) {
        return;
    }
    const Records records = window(sample_order(static_cast<uint8_t>(number_), service_), number_ - 1);
    if (!first_) {
        make_frame(records, judge(records, number_ - 1));
    }
    if (service_) {
        serve();
    }
    in_tick_ = false;
    settle();
}

// The nodes are clocked with the pattern, too.
Records BytesBridge::window(const Bytes &order, uint32_t expected_tick)
{
    const Records records = link_window(bus_, order);
    return pattern_ ? pattern_records(static_cast<uint8_t>(expected_tick)) : records;
}

BytesBridge::Verdicts BytesBridge::judge(const Records &records, uint32_t tick) const
{
    Verdicts verdicts{};
    for (size_t lane = 0; lane < LANES; lane++) {
        const bool used = settings_.lane_mask >> lane & 1u;
        verdicts[lane] = used ? link_verdict(records[lane], static_cast<uint8_t>(tick)) : WHISKER_CODE_LANE_OFF;
    }
    return verdicts;
}

void BytesBridge::serve()
{
    answers_ = window(service_order(static_cast<uint8_t>(number_), order_), asked_tick_);
    answer_verdicts_ = judge(answers_, asked_tick_);
    asked_tick_ = static_cast<uint8_t>(number_);
    windows_++;
    order_.clear();
}

// ------------------------------------------------------------------------------------------- from level to level

void BytesBridge::go_on(const LinkSettings &settings, const SamplingState &state)
{
    halt();
    settings_ = settings;
    run_ = running_ = ticked_ = usb_known_ = true;
    number_ = state.number;
    time_ = state.time;
    before_ = state.before;
    usb_frame_ = state.usb_frame;
    usb_microframe_ = state.usb_microframe;
    usb_time_ = state.usb_time;
    usb_time_before_ = state.usb_time_before;
    counters_ = {state.ticks, state.frames, state.dropped, state.sequence,
                 state.good,  state.absent, state.crc,     state.tick};
}

SamplingState BytesBridge::sampling() const
{
    const Counters &c = counters_;
    return {number_,   time_,      before_, usb_frame_, usb_microframe_, usb_time_, usb_time_before_, c.ticks, c.frames,
            c.dropped, c.sequence, c.good,  c.absent,   c.crc,           c.tick};
}

bool BytesBridge::drained() const
{
    return stream_.drained();
}

// ----------------------------------------------------------------------------------------------------------- frames

Bytes BytesBridge::header(bool last) const
{
    Bytes bytes(WHISKER_FRAME_HEADER_BYTES);
    whisker_put_u16(&bytes[WHISKER_FRAME_HEADER_MAGIC], WHISKER_LIMIT_FRAME_MAGIC);
    bytes[WHISKER_FRAME_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    bytes[WHISKER_FRAME_HEADER_FLAGS] = last ? WHISKER_FRAME_FLAG_LAST : 0;
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_TICK], number_ - 1);
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_TIME], static_cast<uint32_t>(before_));
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_TIME + 4], static_cast<uint32_t>(before_ >> 32));
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_SEQUENCE], counters_.sequence);
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_DROPPED], counters_.dropped);
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_LANE_MASK], settings_.lane_mask);
    bytes[WHISKER_FRAME_HEADER_LANES] = WHISKER_LIMIT_LANES;
    whisker_put_u16(&bytes[WHISKER_FRAME_HEADER_USB_TIME], usb_time_before_);
    bytes[WHISKER_FRAME_HEADER_CRC] = whisker_crc8(bytes.data(), WHISKER_FRAME_HEADER_CRC);
    return bytes;
}

void BytesBridge::make_frame(const Records &records, const Verdicts &verdicts)
{
    Bytes frame = header(finishing_);
    frame.reserve(WHISKER_FRAME_BYTES);
    for (size_t lane = 0; lane < LANES; lane++) {
        const Record record = verdicts[lane] == WHISKER_CODE_OK
                                  ? records[lane]
                                  : error_record(static_cast<uint8_t>(number_ - 1), verdicts[lane]);
        frame.insert(frame.end(), record.begin(), record.end());
    }
    counters_.frames++;
    counters_.sequence++;
    counters_.dropped += stream_.push(frame, finishing_, every_frame()) ? 0 : 1;
    if (stream_.waiting()) {
        kept_verdicts_ = verdicts; // the framer stands still at its first byte
    } else {
        count(verdicts);
    }
}

void BytesBridge::count(const Verdicts &verdicts)
{
    const auto of = [&verdicts](uint8_t code) {
        return static_cast<uint32_t>(std::count(verdicts.begin(), verdicts.end(), code));
    };
    counters_.good += of(WHISKER_CODE_OK);
    counters_.absent += of(WHISKER_CODE_ABSENT);
    counters_.crc += of(WHISKER_CODE_LINK_CRC);
    counters_.tick += of(WHISKER_CODE_LINK_TICK);
}

// The run is over when its last frame is in the FIFO.
void BytesBridge::settle()
{
    if (finishing_ && !in_tick_ && !stream_.waiting()) {
        running_ = stopping_ = finishing_ = ticked_ = false;
    }
}

const Bytes *BytesBridge::packet() const
{
    return stream_.packet();
}

void BytesBridge::packet_taken()
{
    const bool waited = stream_.waiting();
    stream_.packet_taken();
    if (waited && !stream_.waiting()) {
        count(kept_verdicts_);
    }
    settle();
}

} // namespace bridge_sim
