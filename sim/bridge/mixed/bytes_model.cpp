#include "bytes_model.h"

#include <algorithm>

namespace bridge_sim
{

namespace
{

constexpr unsigned USB_TIME_KNOWN = 0x8000;

using Record = std::array<uint8_t, WHISKER_RECORD_BYTES>;

static_assert(WHISKER_ORDER_BYTES == sizeof(uint64_t) && WHISKER_RECORD_BYTES == sizeof(uint64_t));

uint64_t sample_order(uint8_t tick)
{
    Bytes order(WHISKER_ORDER_BYTES);
    order[WHISKER_ORDER_TICK] = tick;
    order[WHISKER_ORDER_COMMAND] = WHISKER_COMMAND_SAMPLE;
    order[WHISKER_ORDER_CRC] = whisker_crc8(order.data(), WHISKER_ORDER_CRC);
    uint64_t bits = 0;
    for (const uint8_t byte : order) {
        bits = bits << 8 | byte;
    }
    return bits;
}

Record record_of(uint64_t bits)
{
    Record record{};
    for (size_t at = 0; at < record.size(); at++) {
        record[at] = static_cast<uint8_t>(bits >> (56 - 8 * at));
    }
    return record;
}

// As pattern_source.v has it.
Record pattern_record(size_t lane, uint8_t tick)
{
    Record record{};
    record[WHISKER_RECORD_TICK] = tick;
    whisker_put_u16(&record[WHISKER_RECORD_ALPHA], static_cast<uint16_t>(0x8000 + 256 * lane + UINT8_MAX - tick));
    whisker_put_u16(&record[WHISKER_RECORD_BETA], static_cast<uint16_t>(0x4000 + 256 * lane + tick));
    record[WHISKER_RECORD_CRC] = whisker_crc8(record.data(), WHISKER_RECORD_CRC);
    return record;
}

// As lane_receiver.v judges.
uint8_t verdict(const Record &record, uint8_t tick)
{
    if (std::all_of(record.begin(), record.end(), [](uint8_t byte) { return byte == UINT8_MAX; })) {
        return WHISKER_CODE_ABSENT;
    }
    if (record[WHISKER_RECORD_CRC] != whisker_crc8(record.data(), WHISKER_RECORD_CRC)) {
        return WHISKER_CODE_LINK_CRC;
    }
    return record[WHISKER_RECORD_TICK] == tick ? WHISKER_CODE_OK : WHISKER_CODE_LINK_TICK;
}

// What framer.v puts in place of one that was not accepted.
Record error_record(uint8_t tick, uint8_t code)
{
    Record record{};
    record[WHISKER_RECORD_TICK] = tick;
    whisker_put_u16(&record[WHISKER_RECORD_STATUS], static_cast<uint16_t>(code << WHISKER_STATUS_CODE_SHIFT));
    record[WHISKER_RECORD_CRC] = whisker_crc8(record.data(), WHISKER_RECORD_CRC);
    return record;
}

void count(SamplingState &state, uint8_t code)
{
    state.good += code == WHISKER_CODE_OK;
    state.absent += code == WHISKER_CODE_ABSENT;
    state.crc += code == WHISKER_CODE_LINK_CRC;
    state.tick += code == WHISKER_CODE_LINK_TICK;
}

} // namespace

BytesModel::BytesModel(NodeBus &bus) : bus_(bus)
{
}

void BytesModel::go_on(const SamplingSettings &settings, const SamplingState &state)
{
    settings_ = settings;
    state_ = state;
    filling_.clear();
    packets_.clear();
}

const SamplingState &BytesModel::sampling() const
{
    return state_;
}

uint32_t BytesModel::tick_period() const
{
    return settings_.tick_period;
}

// As sof_clock.v counts: a packet with the number of the one before is the next eighth.
void BytesModel::start_of_frame(uint64_t microframe)
{
    const auto frame = static_cast<uint16_t>(microframe / 8 % 2048);
    state_.usb_microframe = static_cast<uint8_t>(frame == state_.usb_frame ? (state_.usb_microframe + 1) % 8 : 0);
    state_.usb_frame = frame;
}

// The nodes are clocked with the pattern, too.
void BytesModel::tick(uint64_t microframe, unsigned microframes)
{
    start_of_frame(microframe);
    const auto read = static_cast<uint8_t>(state_.number++); // the tick whose readings come now
    state_.before = state_.time;
    state_.time += settings_.tick_period;
    state_.usb_time_before = state_.usb_time;
    state_.usb_time = static_cast<uint16_t>(USB_TIME_KNOWN | state_.usb_frame << 3 | state_.usb_microframe);
    state_.ticks++;
    bus_.pins(true, true, false, false); // SYNC
    bus_.pins(false, true, false, false);
    for (unsigned i = 1; i < microframes; i++) {
        start_of_frame(microframe + i);
    }

    const std::array<uint64_t, LANES> &arrived = bus_.transfer(sample_order(static_cast<uint8_t>(state_.number)));
    const bool pattern = settings_.options & WHISKER_CONTROL_OPTION_PATTERN;
    Bytes frame = header();
    frame.reserve(WHISKER_FRAME_BYTES);
    for (size_t lane = 0; lane < LANES; lane++) {
        const Record record = pattern ? pattern_record(lane, read) : record_of(arrived[lane]);
        const bool used = settings_.lane_mask >> lane & 1u;
        const uint8_t code = used ? verdict(record, read) : static_cast<uint8_t>(WHISKER_CODE_LANE_OFF);
        const Record shown = code == WHISKER_CODE_OK ? record : error_record(read, code);
        frame.insert(frame.end(), shown.begin(), shown.end());
        count(state_, code);
    }
    state_.frames++;
    state_.sequence++;
    send(frame);
}

Bytes BytesModel::header() const
{
    Bytes bytes(WHISKER_FRAME_HEADER_BYTES);
    whisker_put_u16(&bytes[WHISKER_FRAME_HEADER_MAGIC], WHISKER_LIMIT_FRAME_MAGIC);
    bytes[WHISKER_FRAME_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_TICK], state_.number - 1);
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_TIME], static_cast<uint32_t>(state_.before));
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_TIME + 4], static_cast<uint32_t>(state_.before >> 32));
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_SEQUENCE], state_.sequence);
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_DROPPED], state_.dropped);
    whisker_put_u32(&bytes[WHISKER_FRAME_HEADER_LANE_MASK], settings_.lane_mask);
    bytes[WHISKER_FRAME_HEADER_LANES] = WHISKER_LIMIT_LANES;
    whisker_put_u16(&bytes[WHISKER_FRAME_HEADER_USB_TIME], state_.usb_time_before);
    bytes[WHISKER_FRAME_HEADER_CRC] = whisker_crc8(bytes.data(), WHISKER_FRAME_HEADER_CRC);
    return bytes;
}

void BytesModel::send(const Bytes &frame)
{
    filling_.insert(filling_.end(), frame.begin(), frame.end());
    const bool ends = settings_.options & WHISKER_CONTROL_OPTION_EVERY_FRAME;
    if (ends || filling_.size() == WHISKER_LIMIT_BULK_PACKET) {
        packets_.push_back(std::move(filling_));
        filling_.clear();
    }
}

bool BytesModel::drained() const
{
    return filling_.empty() && packets_.empty();
}

const Bytes *BytesModel::packet() const
{
    return packets_.empty() ? nullptr : &packets_.front();
}

void BytesModel::packet_taken()
{
    packets_.pop_front();
}

} // namespace bridge_sim
