/* Program memory through table reads and writes. */
#include "board/flash.h"

#include "port.h"
#include "sfr.h"

#define ROW_ADDRESSES (2u * FLASH_ROW_WORDS)

/* Points the table instructions at a row; returns its offset in their page. */
static uint16_t flash_point_at(struct board *board, uint16_t row)
{
    const uint32_t address = (uint32_t)row * ROW_ADDRESSES;
    sfr_write(board, TBLPAG, (uint16_t)(address >> 16));
    return (uint16_t)(address & 0xFFFFu);
}

void board_flash_read(struct board *board, uint16_t row, uint8_t *bytes)
{
    const uint16_t offset = flash_point_at(board, row);
    for (uint16_t i = 0; i < FLASH_ROW_WORDS; i++) {
        const uint16_t low = cpu_table_read_low(board, (uint16_t)(offset + 2u * i));
        bytes[3u * i] = (uint8_t)(low & 0xFFu);
        bytes[3u * i + 1u] = (uint8_t)(low >> 8);
        bytes[3u * i + 2u] = (uint8_t)(cpu_table_read_high(board, (uint16_t)(offset + 2u * i)) & 0xFFu);
    }
}

static void flash_operate(struct board *board, uint16_t operation)
{
    sfr_write(board, NVMCON, operation);
    cpu_start_flash(board);
}

void board_flash_erase(struct board *board, uint16_t row)
{
    if (row < WHISKER_LIMIT_APPLICATION_ROW)
        return;
    const uint16_t offset = flash_point_at(board, row);
    cpu_clear_watchdog(board);
    cpu_table_write_low(board, offset, 0xFFFFu); /* any table write there says which page is meant */
    flash_operate(board, NVMCON_ERASE_PAGE);
}

void board_flash_write(struct board *board, uint16_t row, const uint8_t *bytes)
{
    if (row < WHISKER_LIMIT_APPLICATION_ROW)
        return;
    const uint16_t offset = flash_point_at(board, row);
    cpu_clear_watchdog(board);
    for (uint16_t i = 0; i < FLASH_ROW_WORDS; i++) {
        const uint16_t low = (uint16_t)(bytes[3u * i] | (uint16_t)bytes[3u * i + 1u] << 8);
        cpu_table_write_low(board, (uint16_t)(offset + 2u * i), low);
        cpu_table_write_high(board, (uint16_t)(offset + 2u * i), bytes[3u * i + 2u]);
    }
    flash_operate(board, NVMCON_WRITE_ROW);
}

uint16_t board_chip_id(struct board *board)
{
    sfr_write(board, TBLPAG, DEVID_PAGE);
    return cpu_table_read_low(board, DEVID_OFFSET);
}

uint32_t board_serial(struct board *board)
{
    uint32_t serial = 0;
    sfr_write(board, TBLPAG, CONFIG_PAGE);
    for (uint16_t i = 0; i < 4u; i++)
        serial |= (uint32_t)(cpu_table_read_low(board, (uint16_t)(FUID0_OFFSET + 2u * i)) & 0xFFu) << 8u * i;
    return serial;
}

void board_alive(struct board *board)
{
    cpu_clear_watchdog(board);
}

void board_enter_loader(struct board *board)
{
    board->asked = BOARD_ASKED_LOADER;
    cpu_reset(board);
}

void board_run_application(struct board *board)
{
    board->asked = BOARD_ASKED_APPLICATION;
    cpu_reset(board);
}
