/* A gateware image for tests, sealed as fpga/boards/image.py seals one. */
#ifndef WHISKER_TEST_GATEWARE_BYTES_H
#define WHISKER_TEST_GATEWARE_BYTES_H

#include <stddef.h>
#include <stdint.h>

/* Writes magic, format, lengths and both CRCs over what is there; `count` is the whole file's length, more than a
 * header. */
void gateware_seal(uint8_t *bytes, size_t count);

#endif
