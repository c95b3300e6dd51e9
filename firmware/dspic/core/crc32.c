#include "crc32.h"

#include "whisker_protocol.h"

/* The register after four bits that were these: 64 bytes make it four times as fast as bit by bit. */
#define BIT(crc) ((crc) << 1 ^ ((crc)&UINT32_C(0x80000000) ? WHISKER_CRC32_POLYNOMIAL : 0))
#define NIBBLE(n) (BIT(BIT(BIT(BIT(UINT32_C(n) << 28)))) & UINT32_C(0xFFFFFFFF))

static const uint32_t TABLE[16] = {NIBBLE(0),  NIBBLE(1),  NIBBLE(2),  NIBBLE(3), NIBBLE(4),  NIBBLE(5),
                                   NIBBLE(6),  NIBBLE(7),  NIBBLE(8),  NIBBLE(9), NIBBLE(10), NIBBLE(11),
                                   NIBBLE(12), NIBBLE(13), NIBBLE(14), NIBBLE(15)};

uint32_t crc32_of(uint32_t crc, const uint8_t *bytes, uint16_t n)
{
    for (uint16_t i = 0; i < n; i++) {
        crc = crc << 4 ^ TABLE[(uint8_t)(crc >> 28) ^ bytes[i] >> 4];
        crc = crc << 4 ^ TABLE[(uint8_t)(crc >> 28) ^ (bytes[i] & 0x0Fu)];
    }
    return crc;
}
