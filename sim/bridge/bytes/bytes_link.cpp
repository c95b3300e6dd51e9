#include "bytes_link.h"

#include <algorithm>

namespace bridge_sim
{

namespace
{

// In the window the CRC of its head follows the arguments; the report has none, but a byte for the wire version.
constexpr ptrdiff_t HEAD_BYTES = WHISKER_SERVICE_HEAD_CRC - WHISKER_SERVICE_COMMAND;

void put_crc8(Bytes &order)
{
    order[WHISKER_ORDER_CRC] = whisker_crc8(order.data(), WHISKER_ORDER_CRC);
}

// As node_link.v has it: bit by bit, most significant first.
uint32_t crc32_of(const uint8_t *bytes, size_t count)
{
    uint32_t crc = WHISKER_CRC32_INIT;
    for (size_t bit = 0; bit < 8 * count; bit++) {
        const uint32_t feedback = crc >> 31 ^ (bytes[bit / 8] >> (7 - bit % 8) & 1u);
        crc = crc << 1 ^ (feedback ? WHISKER_CRC32_POLYNOMIAL : 0);
    }
    return crc ^ WHISKER_CRC32_XOR_OUT;
}

uint32_t clock_bit(NodeBus &bus, bool mosi)
{
    const uint32_t miso = bus.pins(false, false, true, mosi);
    bus.pins(false, false, false, mosi);
    return miso;
}

static_assert(WHISKER_ORDER_BYTES == sizeof(uint64_t) && WHISKER_RECORD_BYTES == sizeof(uint64_t));

// A tick's first window.
Records sample_window(NodeBus &bus, const Bytes &order)
{
    Records records{};
    uint64_t bits = 0;
    for (const uint8_t byte : order) {
        bits = bits << 8 | byte;
    }
    const std::array<uint64_t, LANES> arrived = bus.transfer(bits);
    for (size_t lane = 0; lane < LANES; lane++) {
        for (size_t at = 0; at < WHISKER_RECORD_BYTES; at++) {
            records[lane][at] = static_cast<uint8_t>(arrived[lane] >> (56 - 8 * at));
        }
    }
    return records;
}

} // namespace

void link_sync(NodeBus &bus)
{
    bus.pins(true, true, false, false);
    bus.pins(false, true, false, false);
}

Records link_window(NodeBus &bus, const Bytes &order)
{
    if (order.size() == WHISKER_ORDER_BYTES) {
        return sample_window(bus, order);
    }
    Records records{};
    bus.pins(false, false, false, false);
    for (size_t at = 0; at < order.size(); at++) {
        for (unsigned bit = 0; bit < 8; bit++) {
            const uint32_t miso = clock_bit(bus, order[at] >> (7 - bit) & 1u);
            for (size_t lane = 0; at < WHISKER_RECORD_BYTES && lane < LANES; lane++) {
                records[lane][at] = static_cast<uint8_t>(records[lane][at] << 1 | (miso >> lane & 1u));
            }
        }
    }
    bus.pins(false, true, false, false);
    return records;
}

Records pattern_records(uint8_t tick)
{
    Records records{};
    for (size_t lane = 0; lane < LANES; lane++) {
        Record &record = records[lane];
        record[WHISKER_RECORD_TICK] = tick;
        whisker_put_u16(&record[WHISKER_RECORD_ALPHA], static_cast<uint16_t>(0x8000 + 256 * lane + UINT8_MAX - tick));
        whisker_put_u16(&record[WHISKER_RECORD_BETA], static_cast<uint16_t>(0x4000 + 256 * lane + tick));
        record[WHISKER_RECORD_CRC] = whisker_crc8(record.data(), WHISKER_RECORD_CRC);
    }
    return records;
}

Bytes sample_order(uint8_t tick, bool service)
{
    Bytes order(WHISKER_ORDER_BYTES);
    order[WHISKER_ORDER_TICK] = tick;
    order[WHISKER_ORDER_COMMAND] = service ? WHISKER_COMMAND_SERVICE : WHISKER_COMMAND_SAMPLE;
    put_crc8(order);
    return order;
}

Bytes service_order(uint8_t tick, const Bytes &report)
{
    Bytes order(WHISKER_SERVICE_BYTES);
    order[WHISKER_SERVICE_TICK] = tick;
    std::copy_n(report.begin() + WHISKER_REPORT_SERVICE_COMMAND, HEAD_BYTES, order.begin() + WHISKER_SERVICE_COMMAND);
    put_crc8(order);
    std::copy(report.begin() + WHISKER_REPORT_SERVICE_DATA, report.end(), order.begin() + WHISKER_SERVICE_DATA);
    const uint32_t crc = crc32_of(order.data(), WHISKER_SERVICE_CRC32);
    for (unsigned i = 0; i < sizeof crc; i++) {
        order[WHISKER_SERVICE_CRC32 + i] = static_cast<uint8_t>(crc >> (24 - 8 * i) & 0xFFu);
    }
    return order;
}

uint8_t link_verdict(const Record &record, uint8_t expected_tick)
{
    if (std::all_of(record.begin(), record.end(), [](uint8_t byte) { return byte == UINT8_MAX; })) {
        return WHISKER_CODE_ABSENT;
    }
    if (record[WHISKER_RECORD_CRC] != whisker_crc8(record.data(), WHISKER_RECORD_CRC)) {
        return WHISKER_CODE_LINK_CRC;
    }
    return record[WHISKER_RECORD_TICK] == expected_tick ? WHISKER_CODE_OK : WHISKER_CODE_LINK_TICK;
}

Record error_record(uint8_t tick, uint8_t code)
{
    Record record{};
    record[WHISKER_RECORD_TICK] = tick;
    whisker_put_u16(&record[WHISKER_RECORD_STATUS], static_cast<uint16_t>(code << WHISKER_STATUS_CODE_SHIFT));
    record[WHISKER_RECORD_CRC] = whisker_crc8(record.data(), WHISKER_RECORD_CRC);
    return record;
}

} // namespace bridge_sim
