/* Loads an image into many nodes at once: all that still take part are asked for the same block, the lowest that one of
 * them wants. */
#include <string.h>

#include "crc32.h"
#include "whisker/errors.h"
#include "whisker/service.h"
#include "whisker_protocol.h"

#define BLOCK_BYTES WHISKER_SERVICE_DATA_BYTES
#define SILENT_ASKS 3 /* times as long as a node may be busy until it counts as gone */
#define START_ROUNDS 8
#define RUN_TIMES 3   /* nobody answers it: a node that misses one hears the next */
#define STUCK_ASKS 16 /* for a block that a node says it wants, until it counts as stuck */
#define IMAGE_BYTES_MAX                                                                                                \
    ((WHISKER_LIMIT_FLASH_ROWS - WHISKER_LIMIT_APPLICATION_ROW - 1u) * WHISKER_LIMIT_FLASH_ROW_BYTES)

struct loading {
    struct whisker_device *device;
    const struct whisker_image *image;
    struct whisker_service_order order; /* with the serial number as its argument */
    struct whisker_update *updates;
    uint32_t lanes;                     /* that still take part */
    uint16_t most[WHISKER_FRAME_LANES]; /* blocks that a lane has ever had */
    uint8_t tries[WHISKER_FRAME_LANES]; /* since it had so many */
};

int whisker_image_parse(const uint8_t *bytes, size_t count, struct whisker_image *image)
{
    if (count < WHISKER_IMAGE_HEADER_BYTES) {
        return WHISKER_ERROR_IMAGE;
    }
    *image = (struct whisker_image){
        .header = bytes,
        .body = bytes + WHISKER_IMAGE_HEADER_BYTES,
        .length = whisker_get_u32(bytes + WHISKER_IMAGE_HEADER_LENGTH),
        .chip = whisker_get_u16(bytes + WHISKER_IMAGE_HEADER_CHIP),
        .version = whisker_get_u16(bytes + WHISKER_IMAGE_HEADER_VERSION),
        .options = whisker_get_u16(bytes + WHISKER_IMAGE_HEADER_OPTIONS),
        .wire_version = bytes[WHISKER_IMAGE_HEADER_WIRE_VERSION],
    };
    const bool sound = whisker_get_u32(bytes + WHISKER_IMAGE_HEADER_MAGIC) == WHISKER_LIMIT_IMAGE_MAGIC &&
                       bytes[WHISKER_IMAGE_HEADER_FORMAT] == WHISKER_LIMIT_IMAGE_FORMAT &&
                       whisker_get_u32(bytes + WHISKER_IMAGE_HEADER_HEADER_CRC32) ==
                           crc32_of(bytes, WHISKER_IMAGE_HEADER_HEADER_CRC32) &&
                       image->length == count - WHISKER_IMAGE_HEADER_BYTES && image->length > 0 &&
                       image->length <= IMAGE_BYTES_MAX && image->length % WHISKER_LIMIT_FLASH_ROW_BYTES == 0 &&
                       whisker_get_u32(bytes + WHISKER_IMAGE_HEADER_BODY_CRC32) == crc32_of(image->body, image->length);
    return sound ? WHISKER_OK : WHISKER_ERROR_IMAGE;
}

static void update_leave(struct loading *l, int lane)
{
    l->lanes &= ~(UINT32_C(1) << lane);
}

/* Asks those that take part; a node that does not answer is left behind. */
static int update_ask(struct loading *l, struct whisker_answer answers[WHISKER_FRAME_LANES])
{
    const int error =
        whisker_service_ask(l->device, &l->order, l->lanes, SILENT_ASKS * WHISKER_LIMIT_BUSY_TICKS_MAX, answers);
    for (int lane = 0; !error && lane < WHISKER_FRAME_LANES; lane++) {
        struct whisker_update *update = &l->updates[lane];
        if (!(l->lanes >> lane & 1)) {
            continue;
        }
        if (answers[lane].valid) {
            update->state = answers[lane].beta;
            update->blocks = answers[lane].alpha;
        } else {
            update->silent = true;
            update_leave(l, lane);
        }
    }
    return error;
}

static void update_leave_refused(struct loading *l)
{
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        if (l->updates[lane].state > WHISKER_NODE_STATE_COMPLETE) {
            update_leave(l, lane);
        }
    }
}

/* Leaves the application, hands over the header. A node that has just restarted may miss either. */
static int update_start(struct loading *l)
{
    struct whisker_answer answers[WHISKER_FRAME_LANES];
    int error = WHISKER_OK;
    bool all = false;
    for (int round = 0; !error && !all && l->lanes && round < START_ROUNDS; round++) {
        l->order.command = WHISKER_SERVICE_COMMAND_ENTER;
        error = whisker_service_ask(l->device, &l->order, 0, 1, answers);
        memcpy(l->order.data, l->image->header, WHISKER_IMAGE_HEADER_BYTES);
        l->order.command = WHISKER_SERVICE_COMMAND_BEGIN;
        if (!error) {
            error = update_ask(l, answers);
        }
        update_leave_refused(l);
        all = true;
        for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
            all = all && (!(l->lanes >> lane & 1) || l->updates[lane].state == WHISKER_NODE_STATE_LOADING);
        }
    }
    return error;
}

/* A node that restarted meanwhile waits in its loader and wants to be begun anew. */
static void update_leave_restarted(struct loading *l)
{
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        if (l->updates[lane].state != WHISKER_NODE_STATE_LOADING) {
            update_leave(l, lane);
        }
    }
}

static uint16_t update_lowest_wanted(const struct loading *l)
{
    uint16_t lowest = UINT16_MAX;
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        if (l->lanes >> lane & 1 && l->updates[lane].blocks < lowest) {
            lowest = l->updates[lane].blocks;
        }
    }
    return lowest;
}

/* Leaves a node that was sent the block it wants again and again and does not take it. */
static void update_leave_stuck(struct loading *l, uint16_t sent)
{
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const uint16_t has = l->updates[lane].blocks;
        if (!(l->lanes >> lane & 1)) {
            continue;
        }
        if (has > l->most[lane]) {
            l->most[lane] = has;
            l->tries[lane] = 0;
        } else if (has <= sent && ++l->tries[lane] >= STUCK_ASKS) {
            l->updates[lane].stuck = true;
            update_leave(l, lane);
        }
    }
}

static int update_send_blocks(struct loading *l, whisker_update_progress progress, void *context)
{
    struct whisker_answer answers[WHISKER_FRAME_LANES];
    const uint32_t total = l->image->length / BLOCK_BYTES;
    int error = WHISKER_OK;
    uint16_t block = l->lanes ? update_lowest_wanted(l) : UINT16_MAX;
    update_leave_restarted(l);
    while (!error && l->lanes && block < total) {
        l->order = (struct whisker_service_order){.command = WHISKER_SERVICE_COMMAND_BLOCK};
        whisker_put_u16(l->order.argument, block);
        memcpy(l->order.data, l->image->body + (size_t)block * BLOCK_BYTES, BLOCK_BYTES);
        error = update_ask(l, answers);
        update_leave_restarted(l);
        update_leave_stuck(l, block);
        block = l->lanes ? update_lowest_wanted(l) : UINT16_MAX;
        if (progress && l->lanes) {
            progress(context, block, total);
        }
    }
    return error;
}

/* Is the image whole everywhere? A node that restarted meanwhile is in another state, and left behind. */
static int update_finish(struct loading *l)
{
    struct whisker_answer answers[WHISKER_FRAME_LANES];
    l->order = (struct whisker_service_order){.command = WHISKER_SERVICE_COMMAND_FINISH};
    const int error = l->lanes ? update_ask(l, answers) : WHISKER_OK;
    for (int lane = 0; !error && lane < WHISKER_FRAME_LANES; lane++) {
        l->updates[lane].done = l->lanes >> lane & 1 && l->updates[lane].state == WHISKER_NODE_STATE_COMPLETE;
    }
    return error;
}

int whisker_nodes_update(struct whisker_device *device, uint32_t lanes, uint32_t serial,
                         const struct whisker_image *image, whisker_update_progress progress, void *context,
                         struct whisker_update updates[WHISKER_FRAME_LANES])
{
    struct loading l = {.device = device, .image = image, .updates = updates, .lanes = lanes};
    struct whisker_answer answers[WHISKER_FRAME_LANES];
    memset(updates, 0, WHISKER_FRAME_LANES * sizeof updates[0]);
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        updates[lane].wanted = lanes >> lane & 1;
    }
    whisker_put_u32(l.order.argument, serial);
    int error = update_start(&l);
    if (!error) {
        error = update_send_blocks(&l, progress, context);
    }
    if (!error) {
        error = update_finish(&l);
    }
    /* Also for those that were refused: they go back to the application they have. */
    l.order = (struct whisker_service_order){.command = WHISKER_SERVICE_COMMAND_RUN};
    for (int i = 0; !error && i < RUN_TIMES; i++) {
        error = whisker_service_ask(device, &l.order, 0, 1, answers);
    }
    return error;
}
