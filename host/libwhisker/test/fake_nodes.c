#include "fake_nodes.h"

#include <string.h>

#include "device_service.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

#define PAGE_BLOCKS (WHISKER_LIMIT_FLASH_PAGE_ROWS * WHISKER_LIMIT_FLASH_ROW_BYTES / WHISKER_SERVICE_DATA_BYTES)

struct fake_nodes fakes;

static struct whisker_service_order order;
static bool pending;
static uint8_t latest[WHISKER_REPORT_ANSWERS_BYTES];

void fake_nodes_reset(int count)
{
    memset(&fakes, 0, sizeof fakes);
    fakes.fail_after = UINT32_MAX;
    pending = false;
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        fakes.node[lane] = (struct fake_node){.there = lane < count,
                                              .chip = WHISKER_LIMIT_CHIP_ID,
                                              .firmware = 0x0100,
                                              .loader = 1,
                                              .wire_version = WHISKER_WIRE_VERSION,
                                              .serial = (uint32_t)lane + 1,
                                              .random = (uint32_t)lane,
                                              .gone_at = NEVER,
                                              .cut_at = NEVER,
                                              .stuck_at = NEVER,
                                              .flash_fails_at = NEVER};
    }
}

static bool addressed(const struct fake_node *n)
{
    const uint32_t serial = whisker_get_u32(order.argument);
    return serial == 0 || serial == n->serial;
}

static void answer(struct fake_node *n, uint16_t alpha, uint16_t beta)
{
    n->command = order.command;
    n->alpha = alpha;
    n->beta = beta;
}

static void tell(struct fake_node *n)
{
    const uint8_t item = order.argument[0];
    if (item == WHISKER_INFO_CHIP) {
        answer(n, n->chip, n->state);
    } else if (item == WHISKER_INFO_FIRMWARE) {
        answer(n, n->firmware, n->options);
    } else if (item == WHISKER_INFO_WIRE) {
        answer(n, n->wire_version, n->loader);
    } else if (item == WHISKER_INFO_SERIAL) {
        answer(n, (uint16_t)n->serial, (uint16_t)(n->serial >> 16));
    } else {
        answer(n, n->health[item - WHISKER_INFO_HEALTH], (uint16_t)(item - WHISKER_INFO_HEALTH));
    }
}

static void begin(struct fake_node *n)
{
    const uint8_t *header = order.data;
    if (n->state == WHISKER_NODE_STATE_LOADING) {
        return;
    }
    n->next = 0;
    n->loads = (uint16_t)(whisker_get_u32(header + WHISKER_IMAGE_HEADER_LENGTH) / WHISKER_SERVICE_DATA_BYTES);
    n->state = !addressed(n)                                                      ? WHISKER_NODE_STATE_NOT_ADDRESSED
               : whisker_get_u16(header + WHISKER_IMAGE_HEADER_CHIP) != n->chip   ? WHISKER_NODE_STATE_OTHER_CHIP
               : header[WHISKER_IMAGE_HEADER_WIRE_VERSION] < WHISKER_WIRE_VERSION ? WHISKER_NODE_STATE_OLD_WIRE
                                                                                  : WHISKER_NODE_STATE_LOADING;
    if (n->state == WHISKER_NODE_STATE_LOADING) {
        n->busy = n->erase_ticks;
        n->firmware = 0; /* its header is erased first */
    }
}

static void take_block(struct fake_node *n)
{
    const uint16_t number = whisker_get_u16(order.argument);
    if (n->state != WHISKER_NODE_STATE_LOADING || number != n->next || number == n->stuck_at) {
        return;
    }
    if (number == n->cut_at) {
        n->cut_at = NEVER;
        n->state = WHISKER_NODE_STATE_LOADER;
        n->busy = n->restart_ticks;
        return;
    }
    n->next++;
    n->there = number != n->gone_at;
    n->busy = number % PAGE_BLOCKS == PAGE_BLOCKS - 1u ? n->erase_ticks : 0;
    if (number == n->flash_fails_at) {
        n->state = WHISKER_NODE_STATE_FLASH_FAILED;
    }
}

static void finish(struct fake_node *n)
{
    if (n->state == WHISKER_NODE_STATE_LOADING && n->next == n->loads) {
        n->state = n->damaged ? WHISKER_NODE_STATE_BAD_IMAGE : WHISKER_NODE_STATE_COMPLETE;
    }
}

static void go(struct fake_node *n, uint16_t state)
{
    n->state = state;
    n->busy = n->restart_ticks;
    n->answering = false;
}

static void run_application(struct fake_node *n)
{
    if (n->misses_runs > 0) {
        n->misses_runs--;
        return;
    }
    if (n->state == WHISKER_NODE_STATE_COMPLETE) {
        n->firmware = 0x0203;
    }
    if (n->firmware != 0 && n->state != WHISKER_NODE_STATE_LOADING && addressed(n)) {
        go(n, WHISKER_NODE_STATE_APPLICATION);
    }
}

static void obey(struct fake_node *n)
{
    const bool application = n->state == WHISKER_NODE_STATE_APPLICATION;
    if (order.command == WHISKER_SERVICE_COMMAND_POLL) {
        return;
    }
    n->answering = true;
    if (order.command == WHISKER_SERVICE_COMMAND_INFO) {
        tell(n);
        return;
    }
    if (order.command == WHISKER_SERVICE_COMMAND_ENTER && application && addressed(n) && !n->stays) {
        go(n, WHISKER_NODE_STATE_LOADER);
        return;
    }
    if (order.command == WHISKER_SERVICE_COMMAND_BEGIN && !application) {
        begin(n);
    } else if (order.command == WHISKER_SERVICE_COMMAND_BLOCK) {
        take_block(n);
    } else if (order.command == WHISKER_SERVICE_COMMAND_FINISH) {
        finish(n);
    } else if (order.command == WHISKER_SERVICE_COMMAND_RUN) {
        run_application(n);
    }
    answer(n, application ? 0 : n->next, application ? WHISKER_NODE_STATE_APPLICATION : n->state);
}

/* A window: what a node said to the order before goes out while this one comes in. */
static void window(struct fake_node *n, uint8_t *at)
{
    const bool hears = n->there && n->busy == 0;
    const bool says = hears && n->answering;
    const unsigned code = says ? WHISKER_CODE_ANSWER : n->there ? WHISKER_CODE_LINK_CRC : WHISKER_CODE_ABSENT;
    whisker_put_u16(at, says ? n->alpha : 0);
    whisker_put_u16(at + 2, says ? n->beta : 0);
    whisker_put_u16(at + 4, (uint16_t)(code << WHISKER_STATUS_CODE_SHIFT | (says ? n->command : 0u)));
    if (!hears) {
        n->busy -= n->busy > 0;
        return;
    }
    n->there = n->stays_for != 1u;
    n->stays_for -= n->stays_for > 1u;
    n->random = n->random * 1664525u + 1013904223u; /* Numerical Recipes' generator */
    if ((n->random >> 16) % 100u >= n->lose_percent) {
        obey(n);
    }
}

int whisker_device_poll(struct whisker_device *device, int timeout_ms)
{
    (void)device;
    (void)timeout_ms;
    fakes.ticks++;
    if (pending && !fakes.ticks_stopped) {
        pending = false;
        for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
            window(&fakes.node[lane], latest + WHISKER_REPORT_ANSWERS_ANSWER + 6 * lane);
        }
    }
    return fakes.orders > fakes.fail_after ? fakes.poll_error : WHISKER_OK;
}

int device_send_service(struct whisker_device *device, const struct whisker_service_order *sent)
{
    (void)device;
    order = *sent;
    pending = true;
    fakes.orders++;
    fakes.count_of[order.command & 7u]++;
    return fakes.orders > fakes.fail_after ? fakes.send_error : WHISKER_OK;
}

int device_answers(struct whisker_device *device, uint8_t *report)
{
    (void)device;
    memcpy(report, latest, sizeof latest);
    report[WHISKER_REPORT_ANSWERS_PENDING] = pending;
    return fakes.orders > fakes.fail_after ? fakes.answers_error : WHISKER_OK;
}
