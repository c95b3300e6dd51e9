#include "crc8.h"

#include "whisker_protocol.h"

/* The CRC is linear: entry i is the sum (XOR) of the entries of its bits, each one step after the one below. */
#define STEP(c) ((((c) << 1) & 0xFFu) ^ (((c)&0x80u) ? WHISKER_CRC8_POLYNOMIAL : 0u))
enum {
    BIT_0 = WHISKER_CRC8_POLYNOMIAL,
    BIT_1 = STEP(BIT_0),
    BIT_2 = STEP(BIT_1),
    BIT_3 = STEP(BIT_2),
    BIT_4 = STEP(BIT_3),
    BIT_5 = STEP(BIT_4),
    BIT_6 = STEP(BIT_5),
    BIT_7 = STEP(BIT_6)
};

#define PART(i, bit) (((i) >> (bit)&1) ? BIT_##bit : 0)
#define ENTRY(i) (PART(i, 0) ^ PART(i, 1) ^ PART(i, 2) ^ PART(i, 3) ^ PART(i, 4) ^ PART(i, 5) ^ PART(i, 6) ^ PART(i, 7))
#define FOUR(i) ENTRY(i), ENTRY((i) + 1), ENTRY((i) + 2), ENTRY((i) + 3)
#define SIXTEEN(i) FOUR(i), FOUR((i) + 4), FOUR((i) + 8), FOUR((i) + 12)
#define SIXTY_FOUR(i) SIXTEEN(i), SIXTEEN((i) + 16), SIXTEEN((i) + 32), SIXTEEN((i) + 48)

static const uint8_t table[256] = {SIXTY_FOUR(0), SIXTY_FOUR(64), SIXTY_FOUR(128), SIXTY_FOUR(192)};

uint8_t crc8_table_driven(const uint8_t *bytes, size_t n)
{
    uint8_t crc = WHISKER_CRC8_INIT;
    for (size_t i = 0; i < n; i++) {
        crc = table[crc ^ bytes[i]];
    }
    return (uint8_t)(crc ^ WHISKER_CRC8_XOR_OUT);
}
