/* A board whose flash is memory: the rows from the application's header on, as many as fit a small machine's RAM too.
 */
#ifndef TESTS_FLASH_BOARD_H
#define TESTS_FLASH_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "boot/image.h"

enum {
    BOARD_ROWS = 18, /* header, 17 of the body: pages end with the 7th and the 15th of it */
    BODY_ROWS = 17,
    BODY_BYTES = BODY_ROWS * WHISKER_LIMIT_FLASH_ROW_BYTES,
    BODY_BLOCKS = BODY_ROWS * 4
};

struct board {
    uint8_t row[BOARD_ROWS][WHISKER_LIMIT_FLASH_ROW_BYTES];
    uint16_t chip;
    uint32_t serial;
    uint16_t erased, written, alive; /* times that the firmware asked for it */
    uint16_t sticks;                 /* row whose first byte does not take what is written; 0: none */
    bool runs;                       /* left for the application */
};

extern struct board flash_board;

/* Erased, chip WHISKER_LIMIT_CHIP_ID, serial number 5. */
void flash_board_reset(void);

/* Byte i of the test's image body. */
uint8_t body_byte(uint16_t i);

/* A sound header for that body; seals a header that was changed. */
void header_make(uint8_t header[WHISKER_IMAGE_HEADER_BYTES]);
void header_seal(uint8_t header[WHISKER_IMAGE_HEADER_BYTES]);

/* Header and body in flash. */
void flash_board_program(const uint8_t header[WHISKER_IMAGE_HEADER_BYTES]);

#endif
