#include "stream_bytes.h"

#include "create/stream.h"

size_t stream_bytes(uint8_t *bytes, const uint8_t *ids, size_t count, const int32_t *value)
{
    size_t at = 2;
    for (size_t i = 0; i < count; i++) {
        bytes[at++] = ids[i];
        if (create_packet_bytes(ids[i]) == 2) {
            bytes[at++] = (uint8_t)((uint32_t)value[ids[i]] >> 8);
        }
        bytes[at++] = (uint8_t)value[ids[i]];
    }
    bytes[0] = CREATE_OI_STREAM_HEADER;
    bytes[1] = (uint8_t)(at - 2);
    uint8_t sum = 0;
    for (size_t i = 0; i < at; i++) {
        sum = (uint8_t)(sum + bytes[i]);
    }
    bytes[at++] = (uint8_t)-sum;
    return at;
}
