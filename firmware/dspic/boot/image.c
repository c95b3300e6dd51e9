#include "image.h"

#include <string.h>

#include "board/flash.h"
#include "crc32.h"

static bool image_header_is_sound(const uint8_t *header)
{
    const uint32_t crc =
        crc32_of(WHISKER_CRC32_INIT, header, (uint16_t)WHISKER_IMAGE_HEADER_HEADER_CRC32) ^ WHISKER_CRC32_XOR_OUT;
    return whisker_get_u32(header + WHISKER_IMAGE_HEADER_MAGIC) == WHISKER_LIMIT_IMAGE_MAGIC &&
           header[WHISKER_IMAGE_HEADER_FORMAT] == WHISKER_LIMIT_IMAGE_FORMAT &&
           whisker_get_u32(header + WHISKER_IMAGE_HEADER_HEADER_CRC32) == crc;
}

/* Rows that fit and are `length` bytes long, 0 if there are none. No division by what is no power of two at 32 bits. */
static uint16_t image_rows_of(uint32_t length)
{
    uint16_t rows = 0;
    while (length >= WHISKER_LIMIT_FLASH_ROW_BYTES && rows < IMAGE_ROWS_MAX) {
        length -= WHISKER_LIMIT_FLASH_ROW_BYTES;
        rows++;
    }
    return length == 0 ? rows : 0;
}

uint8_t image_judge(const uint8_t header[WHISKER_IMAGE_HEADER_BYTES], uint16_t chip)
{
    if (!image_header_is_sound(header))
        return WHISKER_NODE_STATE_BAD_HEADER;
    if (whisker_get_u16(header + WHISKER_IMAGE_HEADER_CHIP) != chip)
        return WHISKER_NODE_STATE_OTHER_CHIP;
    if (header[WHISKER_IMAGE_HEADER_WIRE_VERSION] < WHISKER_WIRE_VERSION)
        return WHISKER_NODE_STATE_OLD_WIRE;
    if (whisker_get_u16(header + WHISKER_IMAGE_HEADER_FIRST_ROW) != IMAGE_FIRST_ROW || image_rows(header) == 0)
        return WHISKER_NODE_STATE_BAD_HEADER;
    return WHISKER_NODE_STATE_LOADING;
}

uint16_t image_rows(const uint8_t header[WHISKER_IMAGE_HEADER_BYTES])
{
    return image_rows_of(whisker_get_u32(header + WHISKER_IMAGE_HEADER_LENGTH));
}

bool image_body_is_good(struct board *board, const uint8_t header[WHISKER_IMAGE_HEADER_BYTES], uint8_t *row)
{
    const uint16_t rows = image_rows(header);
    const uint32_t wanted = whisker_get_u32(header + WHISKER_IMAGE_HEADER_BODY_CRC32);
    uint32_t crc = WHISKER_CRC32_INIT;
    for (uint16_t i = 0; i < rows; i++) {
        board_flash_read(board, (uint16_t)(IMAGE_FIRST_ROW + i), row);
        crc = crc32_of(crc, row, (uint16_t)WHISKER_LIMIT_FLASH_ROW_BYTES);
        board_alive(board);
    }
    return (crc ^ WHISKER_CRC32_XOR_OUT) == wanted;
}

bool image_is_valid(struct board *board, uint8_t *row)
{
    uint8_t header[WHISKER_IMAGE_HEADER_BYTES];
    board_flash_read(board, (uint16_t)WHISKER_LIMIT_APPLICATION_ROW, row);
    memcpy(header, row, sizeof header);
    return image_judge(header, board_chip_id(board)) == WHISKER_NODE_STATE_LOADING &&
           image_body_is_good(board, header, row);
}

bool image_version(struct board *board, uint8_t *row, uint16_t *version, uint16_t *options)
{
    board_flash_read(board, (uint16_t)WHISKER_LIMIT_APPLICATION_ROW, row);
    const bool there = image_header_is_sound(row);
    *version = there ? whisker_get_u16(row + WHISKER_IMAGE_HEADER_VERSION) : 0u;
    *options = there ? whisker_get_u16(row + WHISKER_IMAGE_HEADER_OPTIONS) : 0u;
    return there;
}
