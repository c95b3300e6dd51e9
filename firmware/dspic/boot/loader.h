/* The boot loader's part beside sampling's: takes an image block by block and marks it valid once it is whole.
 *
 *   LOADER --begin--> LOADING --block, block, ..--> LOADING --finish--> COMPLETE --run--> application
 *      any: --begin with an unfit header--> why it was refused
 *
 * begin erases the old header first and finish writes the new one last, so that at any moment the flash holds a whole
 * application or none. */
#ifndef LOADER_H
#define LOADER_H

#include <stdbool.h>
#include <stdint.h>

#include "service.h" // struct service

struct board;

struct loader {
    struct board *board;
    uint8_t state; /* WHISKER_NODE_STATE_* */
    uint16_t next; /* block wanted */
    uint8_t header[WHISKER_IMAGE_HEADER_BYTES];
    uint8_t row[WHISKER_LIMIT_FLASH_ROW_BYTES]; /* being gathered, or in use for a check */
};

void loader_start(struct loader *loader, struct board *board);

/* Deals with the order that waits. May take as long as the flash does. */
void loader_serve(struct loader *loader, struct service *service);

/* Answers `info` but for its health: what application and loader say of themselves alike. `row`: room for one.
 * False: not an item of these. */
bool loader_info(struct board *board, uint8_t item, uint8_t state, uint8_t *row, uint16_t *alpha, uint16_t *beta);

#endif
