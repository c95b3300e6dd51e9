/* Service orders as a bridge sends them, for tests on the host and where int has 16 bits. */
#ifndef TESTS_ORDERS_H
#define TESTS_ORDERS_H

#include <string.h>

#include "crc32.h"
#include "service.h"

/* `argument`: its first four bytes, little-endian; `data`: SERVICE_BLOCK_BYTES, NULL: zeros. */
static inline void order_of(uint8_t bytes[WHISKER_SERVICE_BYTES], uint8_t tick, uint8_t command, uint32_t argument,
                            const uint8_t *data)
{
    memset(bytes, 0, WHISKER_SERVICE_BYTES);
    bytes[WHISKER_SERVICE_TICK] = tick;
    bytes[WHISKER_SERVICE_COMMAND] = command;
    whisker_put_u32(bytes + WHISKER_SERVICE_ARGUMENT, argument);
    bytes[WHISKER_SERVICE_HEAD_CRC] = whisker_crc8(bytes, WHISKER_SERVICE_HEAD_CRC);
    if (data)
        memcpy(bytes + WHISKER_SERVICE_DATA, data, SERVICE_BLOCK_BYTES);
    const uint32_t crc = crc32_of(WHISKER_CRC32_INIT, bytes, (uint16_t)WHISKER_SERVICE_CRC32) ^ WHISKER_CRC32_XOR_OUT;
    for (unsigned i = 0; i < 4u; i++)
        bytes[WHISKER_SERVICE_CRC32 + i] = (uint8_t)(crc >> (24u - 8u * i) & 0xFFu);
}

/* The same as the words of a window. */
static inline void words_of(const uint8_t bytes[WHISKER_SERVICE_BYTES], uint16_t words[SERVICE_WORDS])
{
    for (unsigned i = 0; i < SERVICE_WORDS; i++)
        words[i] = (uint16_t)((uint16_t)bytes[2u * i] << 8 | bytes[2u * i + 1u]);
}

#endif
