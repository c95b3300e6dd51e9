#include "sim_node.h"

#include <stdlib.h>

#include "board_host.h" // struct board, board_*
#include "node.h"       // node_on_*

#define OSCILLATOR_SPREAD_PERMILLE (MLX90333_OSCILLATOR_PERCENT * 10u)

struct sim_node {
    struct board board;
    struct node firmware;
    uint64_t seed;
    bool powered;
    enum sim_sensor_fault fault; /* of the next reading */
    unsigned argument;
};

sim_node *sim_node_new(uint64_t seed)
{
    sim_node *node = calloc(1, sizeof *node);
    if (node)
        node->seed = seed;
    return node;
}

void sim_node_free(sim_node *node)
{
    free(node);
}

static void deliver_next(sim_node *node)
{
    struct board *board = &node->board;
    board->now_ns = board_next_ns(board);
    if (board->byte_ns == board->now_ns) {
        node_on_sensor_byte(&node->firmware, board_clock_byte(board));
    } else {
        board->timer_ns = BOARD_NEVER;
        node_on_timer(&node->firmware);
    }
}

/* Each node's sensor has an oscillator of its own, so that the firmware's waits are tried on slow and quick parts. */
static uint32_t oscillator_permille(uint64_t seed)
{
    const uint64_t mixed = (seed * UINT64_C(0x9E3779B97F4A7C15)) >> 32;
    return 1000u - OSCILLATOR_SPREAD_PERMILLE + (uint32_t)(mixed % (2u * OSCILLATOR_SPREAD_PERMILLE + 1u));
}

void sim_node_power_on(sim_node *node)
{
    board_reset(&node->board, 0);
    mlx90333_power_on(&node->board.sensor, 0, oscillator_permille(node->seed), node->seed);
    node_start(&node->firmware, &node->board);
    node->powered = true;
    while (!node_ready(&node->firmware) && board_next_ns(&node->board) != BOARD_NEVER)
        deliver_next(node);
}

void sim_node_sync(sim_node *node, struct sim_field field)
{
    if (!node->powered)
        return;
    mlx90333_set_field(&node->board.sensor, field.alpha_deg, field.beta_deg);
    mlx90333_set_fault(&node->board.sensor, node->fault, node->argument);
    node->fault = SIM_SENSOR_GOOD;
    node_on_sync(&node->firmware);
}

void sim_node_select(sim_node *node, bool low)
{
    if (node->powered)
        link_slave_select(&node->board.link, low);
}

bool sim_node_sck(sim_node *node, bool level, bool mosi)
{
    if (!node->powered)
        return true;
    if (link_slave_sck(&node->board.link, level, mosi))
        node_on_order(&node->firmware, node->board.link.received);
    return node->board.link.miso;
}

void sim_node_run(sim_node *node)
{
    if (!node->powered)
        return;
    const uint64_t end_ns = node->board.now_ns + SIM_TICK_NS;
    while (board_next_ns(&node->board) < end_ns)
        deliver_next(node);
    node->board.now_ns = end_ns;
}

void sim_node_fault(sim_node *node, enum sim_sensor_fault fault, unsigned argument)
{
    node->fault = fault;
    node->argument = argument;
}

uint32_t sim_node_violations(const sim_node *node)
{
    return mlx90333_violations(&node->board.sensor) + node->board.misuses;
}
