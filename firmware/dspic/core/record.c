#include "record.h"

void record_pack(const struct sensor_reading *reading, uint8_t tick, uint16_t words[LINK_WORDS])
{
    uint8_t bytes[WHISKER_RECORD_BYTES];
    bytes[WHISKER_RECORD_TICK] = tick;
    whisker_put_u16(bytes + WHISKER_RECORD_ALPHA, reading->alpha);
    whisker_put_u16(bytes + WHISKER_RECORD_BETA, reading->beta);
    whisker_put_u16(bytes + WHISKER_RECORD_STATUS, reading->status);
    bytes[WHISKER_RECORD_CRC] = whisker_crc8(bytes, WHISKER_RECORD_CRC);
    for (uint8_t i = 0; i < LINK_WORDS; i++)
        words[i] = (uint16_t)((uint16_t)bytes[2u * i] << 8 | bytes[2u * i + 1u]);
}

bool record_parse_order(const uint16_t words[LINK_WORDS], struct order *order)
{
    uint8_t bytes[WHISKER_ORDER_BYTES];
    for (uint8_t i = 0; i < LINK_WORDS; i++) {
        bytes[2u * i] = (uint8_t)(words[i] >> 8);
        bytes[2u * i + 1u] = (uint8_t)(words[i] & 0xFFu);
    }
    if (whisker_crc8(bytes, WHISKER_ORDER_CRC) != bytes[WHISKER_ORDER_CRC])
        return false;
    order->tick = bytes[WHISKER_ORDER_TICK];
    order->command = bytes[WHISKER_ORDER_COMMAND];
    return true;
}
