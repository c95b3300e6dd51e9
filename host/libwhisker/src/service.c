#include "whisker/service.h"

#include <string.h>

#include "control.h"
#include "device_service.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

#define REPEAT_ASKS 4         /* polls before an order is sent again: it may have met a node that was busy */
#define WINDOW_POLLS_MAX 4000 /* looks for the end of a window before ticks count as stopped */
#define WINDOW_WAIT_MS 0      /* the report itself is asked for in a few hundred microseconds */

_Static_assert(WHISKER_SERVICE_DATA_BYTES == WHISKER_SERVICE_CRC32 - WHISKER_SERVICE_DATA, "size of an order's data");

static void service_read_answers(const uint8_t *report, uint8_t command,
                                 struct whisker_answer answers[WHISKER_FRAME_LANES])
{
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const uint8_t *at = report + WHISKER_REPORT_ANSWERS_ANSWER + 6 * lane;
        struct whisker_answer *answer = &answers[lane];
        if (answer->valid) {
            continue; /* what it said first */
        }
        answer->alpha = whisker_get_u16(at);
        answer->beta = whisker_get_u16(at + 2);
        answer->status = whisker_get_u16(at + 4);
        answer->valid = answer->status == (WHISKER_CODE_ANSWER << WHISKER_STATUS_CODE_SHIFT | command);
    }
}

/* Sends one order and waits for the end of its window; `report` then holds the answers to the order before. */
static int service_exchange(struct whisker_device *device, const struct whisker_service_order *order, uint8_t *report)
{
    int error = device_send_service(device, order);
    for (int i = 0; !error && i < WINDOW_POLLS_MAX; i++) {
        error = whisker_device_poll(device, WINDOW_WAIT_MS);
        if (!error) {
            error = device_answers(device, report);
        }
        if (error || !report[WHISKER_REPORT_ANSWERS_PENDING]) {
            return error;
        }
    }
    return error ? error : WHISKER_ERROR_TIMEOUT;
}

static bool service_all_valid(const struct whisker_answer answers[WHISKER_FRAME_LANES], uint32_t lanes)
{
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        if (lanes >> lane & 1 && !answers[lane].valid) {
            return false;
        }
    }
    return true;
}

int whisker_service_ask(struct whisker_device *device, const struct whisker_service_order *order, uint32_t lanes,
                        unsigned patience, struct whisker_answer answers[WHISKER_FRAME_LANES])
{
    static const struct whisker_service_order POLL = {.command = WHISKER_SERVICE_COMMAND_POLL};
    uint8_t report[WHISKER_REPORT_ANSWERS_BYTES];
    memset(answers, 0, WHISKER_FRAME_LANES * sizeof answers[0]);
    for (unsigned asked = 0; asked == 0 || (asked < patience && !service_all_valid(answers, lanes)); asked++) {
        int error = asked % REPEAT_ASKS == 0 ? service_exchange(device, order, report) : WHISKER_OK;
        if (!error) {
            error = service_exchange(device, &POLL, report);
        }
        if (error) {
            return error;
        }
        service_read_answers(report, order->command, answers);
    }
    return WHISKER_OK;
}

static int service_ask_item(struct whisker_device *device, uint32_t lanes, uint8_t item,
                            struct whisker_answer answers[WHISKER_FRAME_LANES])
{
    const struct whisker_service_order order = {.command = WHISKER_SERVICE_COMMAND_INFO, .argument = {item}};
    return whisker_service_ask(device, &order, lanes, WHISKER_LIMIT_BUSY_TICKS_MAX, answers);
}

static void service_note(struct whisker_node *node, uint8_t item, const struct whisker_answer *answer)
{
    switch (item) {
    case WHISKER_INFO_CHIP:
        node->chip = answer->alpha;
        node->state = answer->beta;
        break;
    case WHISKER_INFO_FIRMWARE:
        node->firmware = answer->alpha;
        node->options = answer->beta;
        break;
    case WHISKER_INFO_WIRE:
        node->wire_version = answer->alpha;
        node->loader = answer->beta;
        break;
    default:
        node->serial = answer->alpha | (uint32_t)answer->beta << 16;
        break;
    }
}

int whisker_nodes_identify(struct whisker_device *device, uint32_t lanes,
                           struct whisker_node nodes[WHISKER_FRAME_LANES])
{
    static const uint8_t ITEMS[] = {WHISKER_INFO_CHIP, WHISKER_INFO_FIRMWARE, WHISKER_INFO_WIRE, WHISKER_INFO_SERIAL};
    uint32_t left = lanes;
    memset(nodes, 0, WHISKER_FRAME_LANES * sizeof nodes[0]);
    for (size_t i = 0; i < sizeof ITEMS; i++) {
        struct whisker_answer answers[WHISKER_FRAME_LANES];
        const int error = service_ask_item(device, left, ITEMS[i], answers);
        if (error) {
            return error;
        }
        for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
            nodes[lane].present = answers[lane].valid && (i == 0 || nodes[lane].present);
            service_note(&nodes[lane], ITEMS[i], &answers[lane]);
            left &= nodes[lane].present ? UINT32_MAX : ~(UINT32_C(1) << lane); /* nobody waits for empty lanes twice */
        }
    }
    return WHISKER_OK;
}

int whisker_nodes_health(struct whisker_device *device, uint32_t lanes, uint8_t counter,
                         uint16_t counts[WHISKER_FRAME_LANES])
{
    struct whisker_answer answers[WHISKER_FRAME_LANES];
    const int error = service_ask_item(device, lanes, (uint8_t)(WHISKER_INFO_HEALTH + counter), answers);
    for (int lane = 0; !error && lane < WHISKER_FRAME_LANES; lane++) {
        counts[lane] = answers[lane].valid && answers[lane].beta == counter ? answers[lane].alpha : 0;
    }
    return error;
}
