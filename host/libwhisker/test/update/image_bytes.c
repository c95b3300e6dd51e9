#include "image_bytes.h"

#include <string.h>

#include "whisker_protocol.h"

/* Byte by byte from a table of 16: another way than the library's and the firmware's. */
static uint32_t crc32_of(const uint8_t *bytes, size_t count)
{
    uint32_t table[16], crc = WHISKER_CRC32_INIT;
    for (uint32_t i = 0; i < 16; i++) {
        table[i] = i << 28;
        for (int bit = 0; bit < 4; bit++) {
            table[i] = table[i] << 1 ^ (table[i] >> 31) * WHISKER_CRC32_POLYNOMIAL;
        }
    }
    for (size_t i = 0; i < 2 * count; i++) {
        const uint32_t nibble = i % 2 ? bytes[i / 2] & 15u : bytes[i / 2] >> 4;
        crc = crc << 4 ^ table[crc >> 28 ^ nibble];
    }
    return crc ^ WHISKER_CRC32_XOR_OUT;
}

void image_seal(uint8_t *bytes, size_t count)
{
    const uint8_t *body = bytes + WHISKER_IMAGE_HEADER_BYTES;
    const size_t length = count - WHISKER_IMAGE_HEADER_BYTES;
    whisker_put_u32(bytes + WHISKER_IMAGE_HEADER_MAGIC, WHISKER_LIMIT_IMAGE_MAGIC);
    bytes[WHISKER_IMAGE_HEADER_FORMAT] = WHISKER_LIMIT_IMAGE_FORMAT;
    whisker_put_u32(bytes + WHISKER_IMAGE_HEADER_LENGTH, (uint32_t)length);
    whisker_put_u32(bytes + WHISKER_IMAGE_HEADER_BODY_CRC32, crc32_of(body, length));
    whisker_put_u32(bytes + WHISKER_IMAGE_HEADER_HEADER_CRC32, crc32_of(bytes, WHISKER_IMAGE_HEADER_HEADER_CRC32));
}

size_t image_make(uint8_t *bytes, unsigned rows)
{
    const size_t count = WHISKER_IMAGE_HEADER_BYTES + (size_t)rows * WHISKER_LIMIT_FLASH_ROW_BYTES;
    memset(bytes, 0, count);
    for (size_t i = WHISKER_IMAGE_HEADER_BYTES; i < count; i++) {
        bytes[i] = (uint8_t)(i * 7u ^ i >> 8);
    }
    whisker_put_u16(bytes + WHISKER_IMAGE_HEADER_CHIP, WHISKER_LIMIT_CHIP_ID);
    bytes[WHISKER_IMAGE_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    whisker_put_u16(bytes + WHISKER_IMAGE_HEADER_VERSION, 0x0203);
    whisker_put_u16(bytes + WHISKER_IMAGE_HEADER_OPTIONS, 0x8000);
    whisker_put_u16(bytes + WHISKER_IMAGE_HEADER_FIRST_ROW, WHISKER_LIMIT_APPLICATION_ROW + 1u);
    image_seal(bytes, count);
    return count;
}
