#include "node.h"

#include "board/link.h" // board_link_arm

/* Gives the link the record of the present tick, as far as it is known. */
static void publish(struct node *node)
{
    node->armed ^= 1u;
    record_pack(&node->reading, node->tick, node->records[node->armed]);
    board_link_arm(node->board, node->records[node->armed]);
}

void node_start(struct node *node, struct board *board, uint8_t code)
{
    node->board = board;
    node->tick = 0xFFu; /* the first SYNC makes it 0 */
    node->numbered = true;
    node->ordered = false;
    node->armed = 0;
    node->reading = sensor_reading_of_code(code);
    publish(node);
    sampler_start(&node->sampler, board, code);
}

bool node_ready(const struct node *node)
{
    return sampler_ready(&node->sampler);
}

void node_on_sync(struct node *node)
{
    const uint8_t code = sampler_on_sync(&node->sampler); /* first: all nodes' readings begin together */
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
        publish(node);
}

void node_on_sensor_overrun(struct node *node)
{
    if (sampler_on_overrun(&node->sampler, &node->reading))
        publish(node);
}

void node_on_transfer_end(struct node *node)
{
    if (!node->ordered)
        publish(node); /* what was clocked of the record armed is lost, with the bridge's knowledge */
    node->ordered = false;
}

void node_on_order(struct node *node, const uint16_t words[LINK_WORDS])
{
    struct order order;
    if (!node->numbered && order_parse(words, &order))
        node->tick = order.tick;
    node->numbered = true;
    node->ordered = true;
    publish(node);
}
