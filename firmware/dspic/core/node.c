#include "node.h"

#include "board/link.h"  // board_link_arm
#include "board/timer.h" // board_watch_start

static void node_count(struct node *node, uint8_t fault)
{
    if (node->health[fault] < UINT16_MAX)
        node->health[fault]++;
}

/* The tick is over: what its record said at last. */
static void node_count_tick(struct node *node, uint16_t status)
{
    const uint8_t code = (uint8_t)(status >> WHISKER_STATUS_CODE_SHIFT);
    if (!node->numbered)
        node_count(node, WHISKER_HEALTH_ORDER_MISSING);
    if (code != WHISKER_CODE_OK && code < WHISKER_CODE_RESET_POWER)
        node_count(node, code);
    else if (code == WHISKER_CODE_OVERRUN)
        node_count(node, WHISKER_HEALTH_OVERRUN);
    else if (code == WHISKER_CODE_OK && status != 0)
        node_count(node, WHISKER_HEALTH_SENSOR_ERROR);
}

static bool node_is_complete(const struct sensor_reading *reading)
{
    return reading->status >> WHISKER_STATUS_CODE_SHIFT == WHISKER_CODE_OK;
}

/* Gives the link the record of the present tick, as far as it is known. */
static void node_publish(struct node *node)
{
    if (node->displaced && node_is_complete(&node->reading))
        node->reading = sensor_reading_of_code(WHISKER_CODE_LATE);
    if (node->serving)
        return; /* its end will */
    node->armed ^= 1u;
    record_pack(&node->reading, node->tick, node->records[node->armed]);
    board_link_arm(node->board, node->records[node->armed]);
}

static void node_reset(struct node *node, struct board *board, uint8_t code)
{
    node->board = board;
    node->tick = 0xFFu; /* the first SYNC makes it 0 */
    node->numbered = true;
    node->ordered = false;
    node->displaced = false;
    node->begun = false;
    node->serving = false;
    node->armed = 0;
    node->reading = sensor_reading_of_code(code);
    for (uint8_t i = 0; i < WHISKER_HEALTH_COUNT; i++)
        node->health[i] = 0;
    service_start(&node->service);
    node_publish(node);
}

void node_start(struct node *node, struct board *board, uint8_t code)
{
    node_reset(node, board, code);
    if (code >= WHISKER_CODE_RESET_POWER)
        node_count(node, code);
    sampler_start(&node->sampler, board, code);
}

void node_start_loader(struct node *node, struct board *board)
{
    node_reset(node, board, WHISKER_CODE_LOADER);
    sampler_off(&node->sampler, board, WHISKER_CODE_LOADER);
}

bool node_ready(const struct node *node)
{
    return sampler_ready(&node->sampler);
}

void node_on_sync(struct node *node)
{
    const uint8_t code = sampler_on_sync(&node->sampler); /* first: all nodes' readings begin together */
    board_watch_start(node->board);
    if (node->begun)
        node_count_tick(node, node->reading.status);
    node->begun = true;
    node->serving = false; /* a second window that never came */
    node->reading = sensor_reading_of_code(code);
    node->tick = (uint8_t)(node->tick + 1u);
    node->numbered = false;
}

void node_on_timer(struct node *node)
{
    (void)sampler_on_timer(&node->sampler); /* what a tick without a reading says, its order's interrupt has armed */
}

void node_on_sensor_byte(struct node *node, uint8_t byte)
{
    if (sampler_on_byte(&node->sampler, byte, &node->reading))
        node_publish(node);
}

void node_on_sensor_overrun(struct node *node)
{
    if (sampler_on_overrun(&node->sampler, &node->reading))
        node_publish(node);
}

void node_on_transfer_end(struct node *node)
{
    if (!node->ordered) {
        node->serving = false;
        node_publish(node); /* what was clocked of the record armed is lost, with the bridge's knowledge */
    }
    node->ordered = false;
}

void node_on_order(struct node *node, const uint16_t words[LINK_WORDS])
{
    struct order order;
    node->displaced = board_watch_exceeds(node->board, NODE_ORDER_MOST_US); /* first: parsing takes its time */
    const bool whole = record_parse_order(words, &order);
    if (!whole)
        node_count(node, WHISKER_HEALTH_ORDER_CRC);
    else if (!node->numbered &&
             !node_is_complete(&node->reading)) /* else SYNC was missed: a reading ends after its order */
        node->tick = order.tick;
    node->numbered = true;
    node->ordered = true;
    node_publish(node);
    if (whole && order.command == WHISKER_COMMAND_SERVICE) {
        node->serving = true;
        board_link_arm_service(node->board, service_words(&node->service));
    }
}

void node_on_service(struct node *node, const uint16_t words[SERVICE_WORDS])
{
    service_take(&node->service, words);
}

void node_on_link_overflow(struct node *node)
{
    node_count(node, WHISKER_HEALTH_LINK_OVERFLOW);
}

bool node_tell_health(struct node *node)
{
    const uint8_t *order = service_next(&node->service);
    if (!order) {
        node_count(node, WHISKER_HEALTH_SERVICE_CRC);
        return true;
    }
    const uint8_t item = (uint8_t)(order[WHISKER_SERVICE_ARGUMENT] - WHISKER_INFO_HEALTH);
    if (order[WHISKER_SERVICE_COMMAND] != WHISKER_SERVICE_COMMAND_INFO || item >= WHISKER_HEALTH_COUNT)
        return false;
    service_answer(&node->service, node->health[item], item);
    return true;
}
