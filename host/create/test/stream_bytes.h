/* Frames of the sensor stream, made for tests. */
#ifndef STREAM_BYTES_H
#define STREAM_BYTES_H

#include <stddef.h>
#include <stdint.h>

/* Writes the frame of these packets to `bytes`; value: by packet id. Returns its length. */
size_t stream_bytes(uint8_t *bytes, const uint8_t *ids, size_t count, const int32_t *value);

#endif
