/* A firmware image for tests, sealed as tools/firmware/make_image.py seals one. */
#ifndef WHISKER_TEST_IMAGE_BYTES_H
#define WHISKER_TEST_IMAGE_BYTES_H

#include <stddef.h>
#include <stdint.h>

/* Writes header and body CRC over what is there; `count` is the whole file's length, a header at least. */
void image_seal(uint8_t *bytes, size_t count);

/* A sound image of `rows` rows into `bytes`; returns its length. */
size_t image_make(uint8_t *bytes, unsigned rows);

#endif
