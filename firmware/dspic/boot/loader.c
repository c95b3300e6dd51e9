#include "loader.h"

#include <string.h>

#include "board/flash.h"
#include "image.h"

#define ROW_BYTES WHISKER_LIMIT_FLASH_ROW_BYTES
#define ROW_BLOCKS (WHISKER_LIMIT_FLASH_ROW_BYTES / SERVICE_BLOCK_BYTES)
#define ERASED 0xFFu

void loader_start(struct loader *loader, struct board *board)
{
    loader->board = board;
    loader->state = WHISKER_NODE_STATE_LOADER;
    loader->next = 0;
}

/* Does the flash hold these bytes? Compares a row at a time, through a buffer of its own. */
static bool loader_holds(struct board *board, uint16_t row, const uint8_t *bytes)
{
    uint8_t found[ROW_BYTES];
    board_flash_read(board, row, found);
    return memcmp(found, bytes, sizeof found) == 0;
}

static void loader_write_row(struct loader *loader, uint16_t row)
{
    if (row % WHISKER_LIMIT_FLASH_PAGE_ROWS == 0)
        board_flash_erase(loader->board, row);
    board_flash_write(loader->board, row, loader->row);
    if (!loader_holds(loader->board, row, loader->row))
        loader->state = WHISKER_NODE_STATE_FLASH_FAILED;
}

static void loader_begin(struct loader *loader, const uint8_t *order)
{
    const uint8_t *header = order + WHISKER_SERVICE_DATA;
    if (!service_addresses(order, board_serial(loader->board))) {
        loader->state = WHISKER_NODE_STATE_NOT_ADDRESSED;
        return;
    }
    if (loader->state == WHISKER_NODE_STATE_LOADING && memcmp(header, loader->header, sizeof loader->header) == 0)
        return;
    loader->state = image_judge(header, board_chip_id(loader->board));
    if (loader->state != WHISKER_NODE_STATE_LOADING)
        return;
    loader->next = 0;
    memcpy(loader->header, header, sizeof loader->header);
    board_flash_erase(loader->board, WHISKER_LIMIT_APPLICATION_ROW);
    memset(loader->row, ERASED, sizeof loader->row);
    if (!loader_holds(loader->board, WHISKER_LIMIT_APPLICATION_ROW, loader->row))
        loader->state = WHISKER_NODE_STATE_FLASH_FAILED;
}

static uint16_t loader_blocks(const struct loader *loader)
{
    return (uint16_t)(image_rows(loader->header) * ROW_BLOCKS);
}

static void loader_take_block(struct loader *loader, const uint8_t *order)
{
    const uint16_t number = whisker_get_u16(order + WHISKER_SERVICE_ARGUMENT);
    if (loader->state != WHISKER_NODE_STATE_LOADING || number != loader->next || number >= loader_blocks(loader))
        return;
    const uint16_t part = number % ROW_BLOCKS;
    memcpy(loader->row + part * SERVICE_BLOCK_BYTES, order + WHISKER_SERVICE_DATA, SERVICE_BLOCK_BYTES);
    loader->next = (uint16_t)(number + 1u);
    if (part == ROW_BLOCKS - 1u)
        loader_write_row(loader, (uint16_t)(IMAGE_FIRST_ROW + number / ROW_BLOCKS));
}

static void loader_finish(struct loader *loader)
{
    if (loader->state != WHISKER_NODE_STATE_LOADING || loader->next != loader_blocks(loader))
        return;
    if (!image_body_is_good(loader->board, loader->header, loader->row)) {
        loader->state = WHISKER_NODE_STATE_BAD_IMAGE;
        return;
    }
    loader->state = WHISKER_NODE_STATE_COMPLETE;
    memset(loader->row, ERASED, sizeof loader->row);
    memcpy(loader->row, loader->header, sizeof loader->header);
    board_flash_write(loader->board, WHISKER_LIMIT_APPLICATION_ROW, loader->row);
    if (!loader_holds(loader->board, WHISKER_LIMIT_APPLICATION_ROW, loader->row))
        loader->state = WHISKER_NODE_STATE_FLASH_FAILED;
}

static void loader_run(struct loader *loader, const uint8_t *order)
{
    if (loader->state == WHISKER_NODE_STATE_LOADING || !service_addresses(order, board_serial(loader->board)))
        return;
    if (image_is_valid(loader->board, loader->row))
        board_run_application(loader->board);
}

bool loader_info(struct board *board, uint8_t item, uint8_t state, uint8_t *row, uint16_t *alpha, uint16_t *beta)
{
    const uint32_t serial = board_serial(board);
    switch (item) {
    case WHISKER_INFO_CHIP:
        *alpha = board_chip_id(board);
        *beta = state;
        return true;
    case WHISKER_INFO_FIRMWARE:
        image_version(board, row, alpha, beta);
        return true;
    case WHISKER_INFO_WIRE:
        *alpha = WHISKER_WIRE_VERSION;
        *beta = LOADER_VERSION;
        return true;
    case WHISKER_INFO_SERIAL:
        *alpha = (uint16_t)(serial & 0xFFFFu);
        *beta = (uint16_t)(serial >> 16);
        return true;
    default:
        return false;
    }
}

/* A row being gathered is not to be lost to a question: it is answered with a buffer of its own. */
static void loader_tell(struct loader *loader, struct service *service, uint8_t item)
{
    uint8_t row[ROW_BYTES];
    uint16_t alpha = 0, beta = 0;
    loader_info(loader->board, item, loader->state, row, &alpha, &beta);
    service_answer(service, alpha, beta);
}

void loader_serve(struct loader *loader, struct service *service)
{
    const uint8_t *order = service_next(service);
    if (!order)
        return;
    switch (order[WHISKER_SERVICE_COMMAND]) {
    case WHISKER_SERVICE_COMMAND_INFO:
        loader_tell(loader, service, order[WHISKER_SERVICE_ARGUMENT]);
        return;
    case WHISKER_SERVICE_COMMAND_BEGIN:
        loader_begin(loader, order);
        break;
    case WHISKER_SERVICE_COMMAND_BLOCK:
        loader_take_block(loader, order);
        break;
    case WHISKER_SERVICE_COMMAND_FINISH:
        loader_finish(loader);
        break;
    case WHISKER_SERVICE_COMMAND_RUN:
        loader_run(loader, order);
        break;
    default:
        break;
    }
    service_answer(service, loader->next, loader->state);
}
