/* Is this a frame's header? */
#ifndef WHISKER_FRAME_HEADER_H
#define WHISKER_FRAME_HEADER_H

#include <stdint.h>

/* Checks the 32 bytes. Returns 0, MAGIC, WIRE_VERSION, HEADER_CRC or LANES. */
int frame_check_header(const uint8_t *bytes);

#endif
