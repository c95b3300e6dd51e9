/* The application in flash: its header in the first row, its body in the rows after. */
#ifndef IMAGE_H
#define IMAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "whisker_protocol.h"

struct board;

#define IMAGE_FIRST_ROW (WHISKER_LIMIT_APPLICATION_ROW + 1u)
#define IMAGE_ROWS_MAX (WHISKER_LIMIT_FLASH_ROWS - IMAGE_FIRST_ROW)
#define LOADER_VERSION 1u

/* May an image with this header be loaded into this chip? Returns WHISKER_NODE_STATE_LOADING, or why not. */
uint8_t image_judge(const uint8_t header[WHISKER_IMAGE_HEADER_BYTES], uint16_t chip);

/* Rows of the body of an image whose header was judged good. */
uint16_t image_rows(const uint8_t header[WHISKER_IMAGE_HEADER_BYTES]);

/* Is the body in flash what the header says? `row`: room for one. */
bool image_body_is_good(struct board *board, const uint8_t header[WHISKER_IMAGE_HEADER_BYTES], uint8_t *row);

/* Is there an application that may run? `row`: room for one; then holds nothing of use. */
bool image_is_valid(struct board *board, uint8_t *row);

/* Version and build options out of the header in flash; false, and zeros, if there is none. `row`: room for one. */
bool image_version(struct board *board, uint8_t *row, uint16_t *version, uint16_t *options);

#endif
