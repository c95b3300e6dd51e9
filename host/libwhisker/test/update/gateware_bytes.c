#include "gateware_bytes.h"

#include "crc32.h"
#include "whisker_protocol.h"

void gateware_seal(uint8_t *bytes, size_t count)
{
    const uint32_t length = (uint32_t)(count - WHISKER_GATEWARE_HEADER_BYTES);
    whisker_put_u32(bytes + WHISKER_GATEWARE_HEADER_MAGIC, WHISKER_LIMIT_GATEWARE_MAGIC);
    bytes[WHISKER_GATEWARE_HEADER_FORMAT] = WHISKER_LIMIT_GATEWARE_FORMAT;
    whisker_put_u32(bytes + WHISKER_GATEWARE_HEADER_LENGTH, length);
    whisker_put_u32(bytes + WHISKER_GATEWARE_HEADER_BODY_CRC32,
                    crc32_of(bytes + WHISKER_GATEWARE_HEADER_BYTES, length));
    whisker_put_u32(bytes + WHISKER_GATEWARE_HEADER_HEADER_CRC32,
                    crc32_of(bytes, WHISKER_GATEWARE_HEADER_HEADER_CRC32));
}
