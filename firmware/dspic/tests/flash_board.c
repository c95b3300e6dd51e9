#include "flash_board.h"

#include <string.h>

#include "board/flash.h"
#include "crc32.h"

struct board flash_board;

static uint8_t *row_of(struct board *board, uint16_t row)
{
    return board->row[(uint16_t)(row - WHISKER_LIMIT_APPLICATION_ROW) % BOARD_ROWS];
}

void flash_board_reset(void)
{
    memset(&flash_board, 0, sizeof flash_board);
    memset(flash_board.row, 0xFF, sizeof flash_board.row);
    flash_board.chip = WHISKER_LIMIT_CHIP_ID;
    flash_board.serial = 5;
}

uint8_t body_byte(uint16_t i)
{
    return (uint8_t)(i * 31u ^ i >> 7);
}

static uint32_t body_crc(void)
{
    uint32_t crc = WHISKER_CRC32_INIT;
    for (uint16_t i = 0; i < BODY_BYTES; i++) {
        const uint8_t byte = body_byte(i);
        crc = crc32_of(crc, &byte, 1);
    }
    return crc ^ WHISKER_CRC32_XOR_OUT;
}

void header_seal(uint8_t header[WHISKER_IMAGE_HEADER_BYTES])
{
    const uint32_t crc = crc32_of(WHISKER_CRC32_INIT, header, (uint16_t)WHISKER_IMAGE_HEADER_HEADER_CRC32);
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_HEADER_CRC32, crc ^ WHISKER_CRC32_XOR_OUT);
}

void header_make(uint8_t header[WHISKER_IMAGE_HEADER_BYTES])
{
    memset(header, 0, WHISKER_IMAGE_HEADER_BYTES);
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_MAGIC, WHISKER_LIMIT_IMAGE_MAGIC);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_CHIP, WHISKER_LIMIT_CHIP_ID);
    header[WHISKER_IMAGE_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION;
    header[WHISKER_IMAGE_HEADER_FORMAT] = WHISKER_LIMIT_IMAGE_FORMAT;
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_LENGTH, BODY_BYTES);
    whisker_put_u32(header + WHISKER_IMAGE_HEADER_BODY_CRC32, body_crc());
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_VERSION, 0x0203);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_OPTIONS, 0x8001);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_FIRST_ROW, IMAGE_FIRST_ROW);
    header_seal(header);
}

void flash_board_program(const uint8_t header[WHISKER_IMAGE_HEADER_BYTES])
{
    memcpy(flash_board.row[0], header, WHISKER_IMAGE_HEADER_BYTES);
    for (uint16_t i = 0; i < BODY_BYTES; i++)
        flash_board.row[1 + i / WHISKER_LIMIT_FLASH_ROW_BYTES][i % WHISKER_LIMIT_FLASH_ROW_BYTES] = body_byte(i);
}

void board_flash_read(struct board *board, uint16_t row, uint8_t *bytes)
{
    memcpy(bytes, row_of(board, row), WHISKER_LIMIT_FLASH_ROW_BYTES);
}

void board_flash_erase(struct board *board, uint16_t row)
{
    const uint16_t first = (uint16_t)(row / WHISKER_LIMIT_FLASH_PAGE_ROWS * WHISKER_LIMIT_FLASH_PAGE_ROWS);
    board->erased++;
    for (uint16_t i = 0; i < WHISKER_LIMIT_FLASH_PAGE_ROWS; i++) {
        if (first + i < WHISKER_LIMIT_APPLICATION_ROW + BOARD_ROWS)
            memset(row_of(board, (uint16_t)(first + i)), 0xFF, WHISKER_LIMIT_FLASH_ROW_BYTES);
    }
}

/* Writing only clears bits. */
void board_flash_write(struct board *board, uint16_t row, const uint8_t *bytes)
{
    uint8_t *at = row_of(board, row);
    board->written++;
    for (uint16_t i = 0; i < WHISKER_LIMIT_FLASH_ROW_BYTES; i++)
        at[i] = (uint8_t)(at[i] & bytes[i]);
    if (row == board->sticks)
        at[0] ^= 0x10u;
}

uint16_t board_chip_id(struct board *board)
{
    return board->chip;
}

uint32_t board_serial(struct board *board)
{
    return board->serial;
}

void board_alive(struct board *board)
{
    board->alive++;
}

void board_enter_loader(struct board *board)
{
    board->runs = false;
}

void board_run_application(struct board *board)
{
    board->runs = true;
}
