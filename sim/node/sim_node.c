#include "sim_node.h"

#include <stdlib.h>
#include <string.h>

#include "dspic.h"
#include "port.h" // struct board, port_*

#define OSCILLATOR_SPREAD_PERMILLE (MLX90333_OSCILLATOR_PERCENT * 10u)
#define TICK_FS (SIM_TICK_NS * DSPIC_FS_PER_NS)
/* When in a tick the bridge selects its nodes and lets them go; its edges in between take no time here. */
#define SELECT_FS (3000u * DSPIC_FS_PER_NS)
#define DESELECT_FS (20000u * DSPIC_FS_PER_NS)

struct sim_node {
    struct dspic *chip;
    struct board board;
    struct mlx90333 sensor;
    uint64_t seed;
    uint64_t tick_fs; /* start of the present tick */
    bool powered;
    enum sim_sensor_fault fault; /* of the next reading */
    unsigned argument;
};

static void on_pin(void *context, unsigned rp, enum dspic_drive drive, uint64_t now_fs)
{
    struct sim_node *node = context;
    const bool level = drive != DSPIC_LOW; /* pulled up */
    const uint64_t now_ns = now_fs / DSPIC_FS_PER_NS;
    if (rp == PIN_SENSOR_SELECT)
        mlx90333_select(&node->sensor, now_ns, level);
    else if (rp == PIN_SENSOR_CLOCK)
        dspic_wire(node->chip, PIN_SENSOR_DATA, mlx90333_clock(&node->sensor, now_ns, level, true));
}

static void on_start(void *context)
{
    struct sim_node *node = context;
    port_start(&node->board);
}

static void on_loop(void *context)
{
    struct sim_node *node = context;
    port_loop(&node->board);
}

static void on_interrupt(void *context, unsigned irq)
{
    struct sim_node *node = context;
    switch (irq) {
    case IRQ_INT1:
        port_on_int1(&node->board);
        break;
    case IRQ_T2:
        port_on_t2(&node->board);
        break;
    case IRQ_SPI1:
        port_on_spi1(&node->board);
        break;
    case IRQ_SPI1_ERROR:
        port_on_spi1_error(&node->board);
        break;
    case IRQ_SPI2_ERROR:
        port_on_spi2_error(&node->board);
        break;
    case IRQ_DMA1:
        port_on_dma1(&node->board);
        break;
    case IRQ_INT2:
        port_on_int2(&node->board);
        break;
    default:
        break;
    }
}

static void on_trap(void *context, enum dspic_trap trap)
{
    struct sim_node *node = context;
    (void)trap;
    port_on_trap(&node->board);
}

sim_node *sim_node_new(uint64_t seed)
{
    sim_node *node = calloc(1, sizeof *node);
    if (!node)
        return NULL;
    struct dspic_parameters parameters;
    dspic_parameters_default(&parameters);
    parameters.seed = seed;
    node->chip = dspic_new(&parameters, &(struct dspic_wiring){node, on_pin, on_start, on_loop, on_interrupt, on_trap});
    node->board.chip = node->chip;
    node->seed = seed;
    if (node->chip)
        return node;
    free(node);
    return NULL;
}

void sim_node_free(sim_node *node)
{
    if (node)
        dspic_free(node->chip);
    free(node);
}

static uint16_t oscillator_permille(uint64_t seed)
{
    const uint64_t mixed = (seed * UINT64_C(0x9E3779B97F4A7C15)) >> 32;
    return (uint16_t)(1000u - OSCILLATOR_SPREAD_PERMILLE + mixed % (2u * OSCILLATOR_SPREAD_PERMILLE + 1u));
}

void sim_node_power_on(sim_node *node)
{
    struct mlx90333_parameters parameters;
    mlx90333_parameters_default(&parameters);
    parameters.slow_permille = oscillator_permille(node->seed);
    parameters.seed = node->seed;
    mlx90333_power_on(&node->sensor, 0, &parameters);
    dspic_wire(node->chip, PIN_LINK_SELECT, true);
    dspic_power_on(node->chip, 0);
    node->powered = true;
    while (!node_ready(&node->board.node) && dspic_next_fs(node->chip) != UINT64_MAX)
        dspic_run_until(node->chip, dspic_next_fs(node->chip));
    node->tick_fs = dspic_now_fs(node->chip);
}

void sim_node_sync(sim_node *node, struct sim_field field)
{
    if (!node->powered)
        return;
    mlx90333_set_field(&node->sensor, &(struct mlx90333_field){.since_ns = node->tick_fs / DSPIC_FS_PER_NS,
                                                               .alpha_deg = field.alpha_deg,
                                                               .beta_deg = field.beta_deg});
    mlx90333_set_fault(&node->sensor, node->fault, node->argument);
    node->fault = SIM_SENSOR_GOOD;
    dspic_input(node->chip, PIN_SYNC, true, node->tick_fs);
    dspic_input(node->chip, PIN_SYNC, false, node->tick_fs);
    dspic_run_until(node->chip, node->tick_fs + SELECT_FS);
}

void sim_node_select(sim_node *node, bool low)
{
    if (node->powered)
        dspic_input(node->chip, PIN_LINK_SELECT, !low, node->tick_fs + (low ? SELECT_FS : DESELECT_FS));
}

bool sim_node_sck(sim_node *node, bool level, bool mosi)
{
    if (!node->powered)
        return true;
    dspic_wire(node->chip, PIN_LINK_MOSI, mosi);
    dspic_input(node->chip, PIN_LINK_CLOCK, level, node->tick_fs + SELECT_FS);
    return dspic_output(node->chip, PIN_LINK_MISO) != DSPIC_LOW;
}

void sim_node_run(sim_node *node)
{
    if (!node->powered)
        return;
    node->tick_fs += TICK_FS;
    dspic_run_until(node->chip, node->tick_fs);
}

void sim_node_fault(sim_node *node, enum sim_sensor_fault fault, unsigned argument)
{
    node->fault = fault;
    node->argument = argument;
}

uint32_t sim_node_violations(const sim_node *node)
{
    const struct dspic_violations v = dspic_violations(node->chip);
    return mlx90333_violations(&node->sensor) + v.overclocked + v.spi_settings + v.spi_disabled + v.spi_overwrite +
           v.pins_locked + v.unlock;
}
