/* Board contract: program memory in rows of WHISKER_LIMIT_FLASH_ROW_BYTES, three bytes per instruction, low byte first;
 * and who the chip is. */
#ifndef BOARD_FLASH_H
#define BOARD_FLASH_H

#include <stdint.h>

struct board; /* the port's own state */

void board_flash_read(struct board *board, uint16_t row, uint8_t *bytes);

/* Erases the page of WHISKER_LIMIT_FLASH_PAGE_ROWS rows that `row` is in; writes an erased row. Nothing else goes on
 * meanwhile: 24.1 ms and 1.6 ms at most. Without effect below WHISKER_LIMIT_APPLICATION_ROW. */
void board_flash_erase(struct board *board, uint16_t row);
void board_flash_write(struct board *board, uint16_t row, const uint8_t *bytes);

uint16_t board_chip_id(struct board *board);

/* FUID0 to FUID3, lowest first; WHISKER_LIMIT_SERIAL_NONE: was never given one. */
uint32_t board_serial(struct board *board);

/* Tells the watchdog that a long computation goes on. */
void board_alive(struct board *board);

/* Leaves for the loader, which then stays, or for the application. On the chip they do not return. */
void board_enter_loader(struct board *board);
void board_run_application(struct board *board);

#endif
