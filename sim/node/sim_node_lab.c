#include "sim_node_lab.h"

#include <string.h>

#include "sim_node_state.h"

uint64_t sim_node_fs(const sim_node *node)
{
    return dspic_now_fs(node->chip);
}

void sim_node_until(sim_node *node, uint64_t at_fs)
{
    dspic_run_until(node->chip, at_fs);
}

void sim_node_pin(sim_node *node, enum sim_node_pin pin, bool level, uint64_t at_fs)
{
    static const uint8_t PIN[] = {PIN_SYNC, PIN_LINK_SELECT, PIN_LINK_CLOCK, PIN_LINK_MOSI};
    dspic_input(node->chip, PIN[pin], level, at_fs);
}

void sim_node_outside(sim_node *node, void (*act)(void *context), void *context)
{
    node->act = act;
    node->act_context = context;
}

void sim_node_plan(sim_node *node, uint64_t at_fs)
{
    dspic_outside_at(node->chip, at_fs);
}

bool sim_node_miso(const sim_node *node)
{
    return dspic_output(node->chip, PIN_LINK_MISO) != DSPIC_LOW;
}

void sim_node_field(sim_node *node, struct sim_field field)
{
    sim_node_set_field(node, sim_node_fs(node), field);
}

void sim_node_sensor_fault(sim_node *node, enum sim_sensor_fault fault, unsigned argument)
{
    mlx90333_set_fault(&node->sensor, fault, argument);
}

/* The chip last: it may not return from this. */
static void sim_node_lab_supply(sim_node *node, bool on)
{
    const uint64_t now = sim_node_fs(node);
    struct mlx90333 *const sensors[] = {&node->sensor, &node->twin};
    for (unsigned i = 0; i < 2u; i++) {
        mlx90333_select(sensors[i], now / DSPIC_FS_PER_NS, true);
        mlx90333_supply(sensors[i], now / DSPIC_FS_PER_NS, on);
    }
    memset(&node->board.node, 0xA5, sizeof node->board.node);
    node->board.trapped = 0xA5A5u;
    if (on)
        dspic_power_on(node->chip, now);
    else
        dspic_power_off(node->chip, now);
}

void sim_node_disturb(sim_node *node, enum sim_node_disturbance what, unsigned argument)
{
    switch (what) {
    case SIM_NODE_TRAP:
        dspic_disturb_trap(node->chip, (enum dspic_trap)argument);
        break;
    case SIM_NODE_RESET:
        dspic_disturb_reset(node->chip, (uint16_t)argument);
        break;
    case SIM_NODE_HANG:
        dspic_disturb_hang(node->chip);
        break;
    case SIM_NODE_COLLISION:
        dspic_disturb_collision(node->chip, argument & 0xFFu, argument > 0xFFu);
        break;
    case SIM_NODE_UNREAD:
        dspic_disturb_unread(node->chip, argument);
        break;
    case SIM_NODE_DARK:
    case SIM_NODE_LIGHT:
        sim_node_lab_supply(node, what == SIM_NODE_LIGHT);
        break;
    case SIM_NODE_SENSOR_OFF:
    case SIM_NODE_SENSOR_ON:
        mlx90333_supply(&node->sensor, sim_node_fs(node) / DSPIC_FS_PER_NS, what == SIM_NODE_SENSOR_ON);
        break;
    default:
        break;
    }
}

struct sim_node_report sim_node_report(const sim_node *node)
{
    return (struct sim_node_report){.frame = node->frame,
                                    .record = node->record,
                                    .arms = node->arms,
                                    .latch_fs = node->sensor.latch_ns * DSPIC_FS_PER_NS,
                                    .age_fs = node->sensor.age_ns * DSPIC_FS_PER_NS,
                                    .armed_fs = node->armed_fs,
                                    .busy_fs = dspic_busy_fs(node->chip),
                                    .interrupts = dspic_interrupts(node->chip),
                                    .fcy_hz = dspic_fcy_hz(node->chip),
                                    .overwritten = dspic_violations(node->chip).spi_overwrite};
}

uint16_t sim_node_counted(const sim_node *node, unsigned counter)
{
    return node->board.node.health[counter];
}
