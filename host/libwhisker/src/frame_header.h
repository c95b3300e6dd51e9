/* The parts of decoding a frame. */
#ifndef WHISKER_FRAME_HEADER_H
#define WHISKER_FRAME_HEADER_H

#include <stdint.h>

#include "whisker/frame.h"

/* Checks the 32 bytes. Returns 0, MAGIC, WIRE_VERSION, HEADER_CRC or LANES. */
int frame_check_header(const uint8_t *bytes);

/* Records of a frame that were not accepted. */
struct frame_damage {
    unsigned damaged; /* by their CRC */
    unsigned slipped; /* by their tick */
};

/* Decodes a whole frame as whisker_frame_decode does, and counts. */
int frame_decode(const uint8_t *bytes, struct whisker_frame *frame, struct frame_damage *damage);

#endif
