/* Frames as a bridge sends them, for tests that need a stream. */
#ifndef WHISKER_TEST_FRAME_BYTES_H
#define WHISKER_TEST_FRAME_BYTES_H

#include <stdint.h>

/* Writes the frame of a tick (256 bytes): 28 lanes at rest, time 30000 cycles per tick, sequence equal to tick. */
void frame_bytes(uint8_t *bytes, uint32_t tick, uint8_t flags);

#endif
