#include "crc32.h"

#include "whisker_protocol.h"

uint32_t crc32_of(const uint8_t *bytes, size_t count)
{
    uint32_t crc = WHISKER_CRC32_INIT;
    for (size_t i = 0; i < count; i++) {
        crc ^= (uint32_t)bytes[i] << 24;
        for (int bit = 0; bit < 8; bit++) {
            crc = crc << 1 ^ (crc >> 31 ? WHISKER_CRC32_POLYNOMIAL : 0);
        }
    }
    return crc ^ WHISKER_CRC32_XOR_OUT;
}
