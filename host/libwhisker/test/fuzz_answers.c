/*
 * libFuzzer target: whatever a bridge says in its report of answers, a lane counts as answered only by a record of that
 * order's, its first one is what is reported, and every question ends. Input: reports, one after another, cut anywhere.
 */
#include <stdlib.h>
#include <string.h>

#include "device_service.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

static const uint8_t *left;
static size_t left_bytes;
static unsigned orders;
static uint8_t command; /* of the latest order that is no poll */

static void require(bool holds)
{
    if (!holds) {
        abort();
    }
}

int whisker_device_poll(struct whisker_device *device, int timeout_ms)
{
    (void)device;
    (void)timeout_ms;
    return WHISKER_OK;
}

int device_send_service(struct whisker_device *device, const struct whisker_service_order *order)
{
    (void)device;
    if (order->command != WHISKER_SERVICE_COMMAND_POLL) {
        command = order->command;
    }
    orders++;
    return WHISKER_OK;
}

/* With nothing left, windows end and lanes are absent. */
int device_answers(struct whisker_device *device, uint8_t *report)
{
    (void)device;
    const size_t count = left_bytes < WHISKER_REPORT_ANSWERS_BYTES ? left_bytes : WHISKER_REPORT_ANSWERS_BYTES;
    memset(report, 0, WHISKER_REPORT_ANSWERS_BYTES);
    memcpy(report, left, count);
    left += count;
    left_bytes -= count;
    return count > 0 && report[0] == 0xFF ? WHISKER_ERROR_DEVICE_CONTROL : WHISKER_OK;
}

static void check_ask(const uint8_t *data, size_t size)
{
    struct whisker_service_order order = {.command = (uint8_t)(data[0] & 7u)};
    struct whisker_answer answers[WHISKER_FRAME_LANES];
    left = data + 1;
    left_bytes = size - 1;
    orders = 0;
    const int error = whisker_service_ask(NULL, &order, UINT32_MAX >> 4, 8, answers);
    require(error == WHISKER_OK || error == WHISKER_ERROR_DEVICE_CONTROL);
    require(orders <= 8 + 2);
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const unsigned wanted = WHISKER_CODE_ANSWER << WHISKER_STATUS_CODE_SHIFT | order.command;
        require(!answers[lane].valid || answers[lane].status == wanted);
    }
}

static void check_identity(const uint8_t *data, size_t size)
{
    struct whisker_node nodes[WHISKER_FRAME_LANES];
    uint16_t counts[WHISKER_FRAME_LANES];
    left = data;
    left_bytes = size;
    (void)whisker_nodes_identify(NULL, UINT32_MAX >> 4, nodes);
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        require(!nodes[lane].present || command == WHISKER_SERVICE_COMMAND_INFO);
    }
    left = data;
    left_bytes = size;
    const int error = whisker_nodes_health(NULL, 1, WHISKER_HEALTH_STEP, counts);
    require(error == WHISKER_OK || error == WHISKER_ERROR_DEVICE_CONTROL);
}

/* Two reports, the second another answer of the same lane. */
static void check_first(const uint8_t *data)
{
    uint8_t reports[4 * WHISKER_REPORT_ANSWERS_BYTES] = {0};
    struct whisker_answer answers[WHISKER_FRAME_LANES];
    const struct whisker_service_order order = {.command = WHISKER_SERVICE_COMMAND_INFO};
    for (unsigned r = 1; r < 4u; r++) {
        uint8_t *at = reports + r * WHISKER_REPORT_ANSWERS_BYTES + WHISKER_REPORT_ANSWERS_ANSWER;
        whisker_put_u16(at, data[r]);
        whisker_put_u16(at + 4, WHISKER_CODE_ANSWER << WHISKER_STATUS_CODE_SHIFT | WHISKER_SERVICE_COMMAND_INFO);
    }
    left = reports;
    left_bytes = sizeof reports;
    require(whisker_service_ask(NULL, &order, 3, 3, answers) == WHISKER_OK);
    require(answers[0].valid && answers[0].alpha == data[1] && !answers[1].valid);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 4) {
        return 0;
    }
    check_ask(data, size);
    check_identity(data, size);
    check_first(data);
    return 0;
}
