#include "node.h"

#include "board/link.h" // board_link_arm

static void pack(struct node *node)
{
    record_pack(&node->reading, node->tick, node->records[node->armed ^ 1u]);
}

static void arm(struct node *node)
{
    node->armed ^= 1u;
    board_link_arm(node->board, node->records[node->armed]);
}

void node_start(struct node *node, struct board *board)
{
    node->board = board;
    node->tick = 0xFFu; /* the first SYNC makes it 0 */
    node->armed = 0;
    node->reading = sensor_reading_of_code(WHISKER_CODE_STARTING);
    pack(node);
    arm(node);
    pack(node);
    sampler_start(&node->sampler, board);
}

bool node_ready(const struct node *node)
{
    return sampler_ready(&node->sampler);
}

void node_on_sync(struct node *node)
{
    const uint8_t code = sampler_on_sync(&node->sampler); /* first: all nodes' readings begin together */
    arm(node);
    node->tick = (uint8_t)(node->tick + 1u);
    node->reading = sensor_reading_of_code(code);
    pack(node);
}

void node_on_timer(struct node *node)
{
    sampler_on_timer(&node->sampler);
}

void node_on_sensor_byte(struct node *node, uint8_t byte)
{
    if (sampler_on_byte(&node->sampler, byte, &node->reading))
        pack(node);
}

void node_on_order(struct node *node, const uint16_t words[LINK_WORDS])
{
    struct order order;
    if (!order_parse(words, &order) || order.tick == node->tick)
        return;
    node->tick = order.tick;
    pack(node);
}
