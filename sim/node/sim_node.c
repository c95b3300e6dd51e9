#include "sim_node.h"

#include <stdlib.h>
#include <string.h>

#include "node_cycles.h"
#include "sim_node_state.h"

#define OSCILLATOR_SPREAD_PERMILLE (MLX90333_OSCILLATOR_PERCENT * 10u)
/* When in a tick the bridge selects its nodes and lets them go; its edges in between take no time here. */
#define SELECT_FS (3000u * DSPIC_FS_PER_NS)
#define DESELECT_FS (20000u * DSPIC_FS_PER_NS)
/* And in the second window of a tick with a service order. */
#define SERVICE_SELECT_FS (70000u * DSPIC_FS_PER_NS)
#define SERVICE_DESELECT_FS (290000u * DSPIC_FS_PER_NS)
/* A chip so far ahead of a tick's SYNC stands still: what comes in this tick passes it by. */
#define STALLED_FS (20000u * DSPIC_FS_PER_NS)

static void sim_node_on_pin(void *context, unsigned rp, enum dspic_drive drive, uint64_t now_fs)
{
    struct sim_node *node = context;
    const bool level = drive != DSPIC_LOW; /* pulled up */
    const uint64_t now_ns = now_fs / DSPIC_FS_PER_NS;
    if (rp == PIN_SENSOR_SELECT)
        sim_node_sensor_select(node, level, now_ns);
    else if (rp == PIN_SENSOR_CLOCK)
        sim_node_sensor_clock(node, level, now_ns);
}

static uint64_t sim_node_record_of(const struct node *firmware)
{
    uint64_t bits = 0;
    for (unsigned i = 0; i < LINK_WORDS; i++)
        bits = bits << 16 | firmware->records[firmware->armed & 1u][i];
    return bits;
}

static void sim_node_note_armed(struct sim_node *node)
{
    node->arms++;
    node->armed_fs = dspic_now_fs(node->chip);
    node->record = sim_node_record_of(&node->board.node);
}

static void sim_node_on_start(void *context)
{
    struct sim_node *node = context;
    sim_node_sensor_forget_releases(node);
    port_boot(&node->board);
    sim_node_note_armed(node);
}

static void sim_node_on_loop(void *context)
{
    struct sim_node *node = context;
    port_loop(&node->board);
}

static void sim_node_serve(struct sim_node *node, unsigned irq)
{
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

enum handler {
#define NAME(name, register, acts, whole) HANDLER_##name,
    NODE_CYCLES(NAME)
#undef NAME
};

static enum handler sim_node_handler_of_t2(const struct sampler *sampler)
{
    switch (sampler->state) {
    case SAMPLER_GAP:
        return HANDLER_GAP;
    case SAMPLER_RELEASE:
        return HANDLER_RAISE;
    case SAMPLER_RESYNC_HIGH:
        return HANDLER_LOWER;
    default:
        return HANDLER_READY;
    }
}

/* What an interrupt is about to do, and so how long it takes. */
static enum handler sim_node_handler_of(const struct board *board, unsigned irq)
{
    const struct sampler *sampler = &board->node.sampler;
    switch (irq) {
    case IRQ_T2:
        return sim_node_handler_of_t2(sampler);
    case IRQ_SPI1:
        return sampler->count + 1u < MLX90333_FRAME_BYTES ? HANDLER_BYTE : HANDLER_LAST_BYTE;
    case IRQ_DMA1:
        return board->link_words == SERVICE_WORDS ? HANDLER_SERVICE : HANDLER_ORDER;
    case IRQ_INT2:
        return board->node.ordered ? HANDLER_SELECT_UP : HANDLER_SELECT_UP_BROKEN;
    default:
        return HANDLER_SYNC;
    }
}

static void sim_node_on_interrupt(void *context, unsigned irq)
{
    static const struct {
        uint16_t address, acts, whole;
    } CYCLES[] = {
#define CYCLES_OF(name, register, acts, whole) {register, acts, whole},
        NODE_CYCLES(CYCLES_OF)
#undef CYCLES_OF
    };
    struct sim_node *node = context;
    const uint8_t before = node->board.node.armed;
    const enum handler handler = sim_node_handler_of(&node->board, irq);
    const uint64_t cycle_fs = dspic_cycle_fs(node->chip);
    const uint64_t end_fs =
        dspic_now_fs(node->chip) + (CYCLES[handler].whole - node->parameters.chip.exit_cycles) * cycle_fs;
    sim_node_sensor_note_releases(node);
    dspic_compute_until(node->chip, CYCLES[handler].acts, CYCLES[handler].address);
    sim_node_serve(node, irq);
    if (node->board.node.armed != before) {
        sim_node_note_armed(node);
        if (irq == IRQ_SPI1)
            sim_node_sensor_end_frame(node);
    }
    if (end_fs > dspic_now_fs(node->chip))
        dspic_compute(node->chip, (end_fs - dspic_now_fs(node->chip)) / cycle_fs);
}

static void sim_node_on_outside(void *context)
{
    struct sim_node *node = context;
    node->act(node->act_context);
}

static void sim_node_on_trap(void *context, enum dspic_trap trap)
{
    struct sim_node *node = context;
    (void)trap;
    port_on_trap(&node->board);
}

static uint16_t sim_node_oscillator_permille(uint64_t seed)
{
    const uint64_t mixed = (seed * UINT64_C(0x9E3779B97F4A7C15)) >> 32;
    return (uint16_t)(1000u - OSCILLATOR_SPREAD_PERMILLE + mixed % (2u * OSCILLATOR_SPREAD_PERMILLE + 1u));
}

void sim_node_parameters_default(struct sim_node_parameters *parameters, uint64_t seed)
{
    dspic_parameters_default(&parameters->chip);
    mlx90333_parameters_default(&parameters->sensor);
    parameters->chip.seed = parameters->sensor.seed = seed;
    parameters->sensor.slow_permille = sim_node_oscillator_permille(seed);
}

sim_node *sim_node_new_as(const struct sim_node_parameters *parameters)
{
    sim_node *node = calloc(1, sizeof *node);
    if (!node)
        return NULL;
    node->parameters = *parameters;
    node->chip = dspic_new(&parameters->chip,
                           &(struct dspic_wiring){node, sim_node_on_pin, sim_node_on_start, sim_node_on_loop,
                                                  sim_node_on_interrupt, sim_node_on_trap, sim_node_on_outside});
    node->board.chip = node->chip;
    if (node->chip) {
        sim_node_program_default(node);
        return node;
    }
    free(node);
    return NULL;
}

sim_node *sim_node_new(uint64_t seed)
{
    struct sim_node_parameters parameters;
    sim_node_parameters_default(&parameters, seed);
    return sim_node_new_as(&parameters);
}

sim_node *sim_node_new_named(uint64_t seed, uint32_t serial, uint16_t chip)
{
    struct sim_node_parameters parameters;
    sim_node_parameters_default(&parameters, seed);
    parameters.chip.serial = serial;
    parameters.chip.device_id = chip;
    return sim_node_new_as(&parameters);
}

void sim_node_free(sim_node *node)
{
    if (node)
        dspic_free(node->chip);
    free(node);
}

void sim_node_power_on(sim_node *node)
{
    if (node->quick.on)
        node->quick.level->leave(node);
    sim_node_sensor_power_on(node);
    dspic_wire(node->chip, PIN_LINK_SELECT, true);
    dspic_power_on(node->chip, 0);
    node->powered = true;
    while (!node->board.loading && !node_ready(&node->board.node) && dspic_next_fs(node->chip) != UINT64_MAX)
        dspic_run_until(node->chip, dspic_next_fs(node->chip));
    node->tick_fs = dspic_now_fs(node->chip);
}

void sim_node_sync(sim_node *node, struct sim_field field)
{
    if (node->quick.on && node->quick.level->sync(node, field))
        return;
    node->came = (struct sim_node_tick){.field = field,
                                        .step = node->came.step == SIM_NODE_ASLEEP ? SIM_NODE_SYNCED : SIM_NODE_ODD};
    node->bits = 0;
    node->second = false;
    node->deaf = !node->powered || sim_node_dark(node) || dspic_now_fs(node->chip) > node->tick_fs + STALLED_FS;
    if (node->deaf)
        return;
    sim_node_sensor_set_fields(node, node->tick_fs, field);
    sim_node_sensor_fault(node, node->fault, node->argument);
    node->fault = SIM_SENSOR_GOOD;
    dspic_input(node->chip, PIN_SYNC, true, node->tick_fs);
    dspic_input(node->chip, PIN_SYNC, false, node->tick_fs);
    dspic_run_until(node->chip, node->tick_fs + SELECT_FS);
}

void sim_node_note_select(struct sim_node_tick *came, bool low)
{
    const enum sim_node_step from = low ? SIM_NODE_SYNCED : SIM_NODE_SELECTED;
    const bool whole = low || (came->bits == LINK_BITS && !came->high);
    came->step = came->step != from || !whole ? SIM_NODE_ODD : low ? SIM_NODE_SELECTED : SIM_NODE_ENDED;
}

void sim_node_note_sck(struct sim_node_tick *came, bool level, bool mosi)
{
    if (came->step != SIM_NODE_SELECTED || level == came->high || (level && came->bits == LINK_BITS)) {
        came->step = SIM_NODE_ODD;
        return;
    }
    came->high = level;
    came->bits = (uint8_t)(came->bits + level);
    if (!level)
        came->order = came->order << 1 | mosi;
}

void sim_node_select(sim_node *node, bool low)
{
    static const uint64_t AT_FS[2][2] = {{DESELECT_FS, SELECT_FS}, {SERVICE_DESELECT_FS, SERVICE_SELECT_FS}};
    if (node->quick.on && node->quick.level->select(node, low))
        return;
    sim_node_note_select(&node->came, low);
    if (low)
        node->second = node->bits >= LINK_BITS; /* after a whole transfer, not one cut short */
    if (!node->deaf)
        dspic_input(node->chip, PIN_LINK_SELECT, !low, node->tick_fs + AT_FS[node->second][low]);
}

bool sim_node_sck(sim_node *node, bool level, bool mosi)
{
    bool miso = true;
    if (node->quick.on && node->quick.level->sck(node, level, mosi, &miso))
        return miso;
    sim_node_note_sck(&node->came, level, mosi);
    if (node->deaf)
        return true;
    node->bits += level;
    dspic_wire(node->chip, PIN_LINK_MOSI, mosi);
    dspic_input(node->chip, PIN_LINK_CLOCK, level, node->tick_fs + SELECT_FS);
    return dspic_output(node->chip, PIN_LINK_MISO) != DSPIC_LOW;
}

uint64_t sim_node_transfer(sim_node *node, uint64_t order)
{
    uint64_t bits = 0;
    if (node->quick.on && node->came.step == SIM_NODE_SYNCED) {
        bits = node->quick.record;
        node->came = (struct sim_node_tick){node->came.field, order, LINK_BITS, false, SIM_NODE_SELECTED};
    } else {
        sim_node_select(node, true);
        for (unsigned i = LINK_BITS; i-- > 0;) {
            const bool mosi = order >> i & 1u;
            bits = bits << 1 | sim_node_sck(node, true, mosi);
            (void)sim_node_sck(node, false, mosi);
        }
    }
    sim_node_select(node, false);
    return bits;
}

void sim_node_run_registers(sim_node *node)
{
    node->tick_fs += SIM_NODE_TICK_FS;
    dspic_run_until(node->chip, node->tick_fs);
}

void sim_node_run(sim_node *node)
{
    if (!node->powered || (node->quick.on && node->quick.level->run(node)))
        return;
    sim_node_run_registers(node);
    if (node->quick.level)
        node->quick.level->enter(node);
    node->came.step = SIM_NODE_ASLEEP;
}

void sim_node_cut(sim_node *node, uint64_t after_ns)
{
    if (node->quick.on)
        node->quick.level->leave(node);
    dspic_cut_power_at(node->chip, node->tick_fs + after_ns * DSPIC_FS_PER_NS);
}

bool sim_node_dark(const sim_node *node)
{
    return node->powered && !dspic_powered(node->chip);
}

void sim_node_restore(sim_node *node)
{
    sim_node_disturb(node, SIM_NODE_LIGHT, 0);
}

void sim_node_fault(sim_node *node, enum sim_sensor_fault fault, unsigned argument)
{
    node->fault = fault;
    node->argument = argument;
}

uint32_t sim_node_violations(const sim_node *node)
{
    const struct dspic_violations v = dspic_violations(node->chip);
    return sim_node_sensor_violations(node) + v.overclocked + v.pll_running + v.spi_settings + v.spi_disabled +
           v.spi_overwrite + v.pins_locked + v.unlock;
}

/* ---- on the test bench: sim_node_lab.h */

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
    sim_node_sensor_set_fields(node, sim_node_fs(node), field);
}

/* The chip last: it may not return from this. */
static void sim_node_lab_supply(sim_node *node, bool on)
{
    const uint64_t now = sim_node_fs(node);
    sim_node_sensor_supply(node, on);
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
        sim_node_sensor_switch(node, what == SIM_NODE_SENSOR_ON);
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
