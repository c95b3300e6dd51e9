/* A node at record level: a tick in which nothing but a reading and its record is due is taken as a whole. The sensor's
 * model senses at the instant at which it latches, the firmware's own decoder, sampler and record make the record, and
 * no register is touched. The chip stands meanwhile where its last tick ended. Before anything else happens, and once
 * in CHECK_TICKS, it makes up for the time: the last tick is run with its registers, and must bring the same record. */
#include <string.h>

#include "sim_node_state.h"

enum { CHECK_TICKS = 1000 };

bool sim_node_differs(const sim_node *node)
{
    return node->quick.differs;
}

static bool sim_node_record_parse(uint64_t bits, struct order *order)
{
    uint16_t words[LINK_WORDS];
    for (unsigned i = 0; i < LINK_WORDS; i++)
        words[i] = (uint16_t)(bits >> (48u - 16u * i));
    return record_parse_order(words, order) && order->command == WHISKER_COMMAND_SAMPLE;
}

/* One SYNC, one whole transfer, and an order that asks for no more than a reading. */
static bool sim_node_record_is_plain(const struct sim_node_tick *tick)
{
    struct order order;
    return tick->step == SIM_NODE_ENDED && sim_node_record_parse(tick->order, &order);
}

static bool sim_node_record_sensor_rests(const struct mlx90333 *sensor)
{
    return sensor->fault == SIM_SENSOR_GOOD && sensor->enabled && !sensor->select && !sensor->dark &&
           !sensor->slipped && !sensor->reset_due && sensor->byte == 0 && sensor->bit == 0;
}

static bool sim_node_record_firmware_rests(const struct node *firmware)
{
    return sampler_ready(&firmware->sampler) && firmware->reading.status == 0 && firmware->numbered &&
           !firmware->ordered && !firmware->displaced && !firmware->serving;
}

static struct sim_node_state_of_tick sim_node_record_state(const struct sim_node *node)
{
    const struct node *firmware = &node->board.node;
    return (struct sim_node_state_of_tick){firmware->sampler, firmware->reading, firmware->tick, node->sensor.sense};
}

static void sim_node_record_enter(struct sim_node *node)
{
    struct sim_node_quick *quick = &node->quick;
    if (!sim_node_record_is_plain(&node->came) || !sim_node_record_sensor_rests(&node->sensor) || node->apart ||
        !sim_node_record_firmware_rests(&node->board.node) || !dspic_rests(node->chip))
        return;
    quick->on = true;
    quick->ticks = 0;
    quick->now = sim_node_record_state(node);
    quick->record = node->record;
    quick->latch_ns = node->sensor.latch_ns - (node->tick_fs - SIM_NODE_TICK_FS) / DSPIC_FS_PER_NS;
}

/* What came in a tick, with the chip's registers. */
static void sim_node_record_replay(struct sim_node *node, const struct sim_node_tick *tick)
{
    sim_node_sync(node, tick->field);
    if (tick->step == SIM_NODE_SYNCED)
        return;
    sim_node_select(node, true);
    for (unsigned i = 1; i <= tick->bits; i++) {
        const bool whole = i < tick->bits || !tick->high;
        const bool mosi = whole && tick->order >> (tick->bits - tick->high - i) & 1u;
        (void)sim_node_sck(node, true, mosi);
        if (whole)
            (void)sim_node_sck(node, false, mosi);
    }
    if (tick->step == SIM_NODE_ENDED)
        sim_node_select(node, false);
}

static void sim_node_record_put_sense(struct mlx90333 *sensor, const struct mlx90333_sense *sense)
{
    sensor->sense = *sense;
    sensor->sense.parameters = &sensor->parameters;
}

static bool sim_node_record_agrees(const struct sim_node *node)
{
    const struct sim_node_state_of_tick is = sim_node_record_state(node), *wanted = &node->quick.now;
    return node->record == node->quick.record && is.tick == wanted->tick &&
           is.reading.status == wanted->reading.status && is.reading.alpha == wanted->reading.alpha &&
           is.reading.beta == wanted->reading.beta && is.sampler.state == wanted->sampler.state &&
           is.sampler.followed == wanted->sampler.followed && is.sampler.alpha == wanted->sampler.alpha &&
           is.sampler.beta == wanted->sampler.beta &&
           memcmp(is.sampler.frame, wanted->sampler.frame, sizeof is.sampler.frame) == 0;
}

/* The ticks before the last one left nothing behind but time and what the last began with. */
static void sim_node_record_make_up(struct sim_node *node)
{
    const struct sim_node_quick *quick = &node->quick;
    dspic_skip(node->chip, (quick->ticks - 1u) * SIM_NODE_TICK_FS);
    node->tick_fs -= SIM_NODE_TICK_FS;
    node->board.node.sampler = quick->before.sampler;
    sim_node_record_put_sense(&node->sensor, &quick->before.sense);
    node->came.step = SIM_NODE_ASLEEP;
    sim_node_record_replay(node, &quick->last);
    sim_node_run_registers(node);
}

static void sim_node_record_leave(struct sim_node *node)
{
    const struct sim_node_tick came = node->came;
    const enum sim_sensor_fault fault = node->fault; /* of a reading to come */
    node->quick.on = false;
    node->fault = SIM_SENSOR_GOOD;
    if (node->quick.ticks > 0) {
        sim_node_record_make_up(node);
        node->quick.differs |= !sim_node_record_agrees(node);
    }
    node->came.step = SIM_NODE_ASLEEP;
    if (came.step != SIM_NODE_ASLEEP)
        sim_node_record_replay(node, &came);
    node->fault = fault;
}

static bool sim_node_record_sync(struct sim_node *node, struct sim_field field)
{
    struct sim_node_quick *quick = &node->quick;
    const bool stays = quick->until_check > 1u && node->fault == SIM_SENSOR_GOOD && node->came.step == SIM_NODE_ASLEEP;
    quick->until_check = quick->until_check > 1u ? quick->until_check - 1u : CHECK_TICKS;
    if (!stays) {
        sim_node_record_leave(node);
        return false;
    }
    node->came = (struct sim_node_tick){.field = field, .step = SIM_NODE_SYNCED};
    return true;
}

static bool sim_node_record_select(struct sim_node *node, bool low)
{
    struct sim_node_tick then = node->came;
    sim_node_note_select(&then, low);
    if (then.step == SIM_NODE_ODD) {
        sim_node_record_leave(node);
        return false;
    }
    node->came = then;
    return true;
}

static bool sim_node_record_sck(struct sim_node *node, bool level, bool mosi, bool *miso)
{
    struct sim_node_tick then = node->came;
    sim_node_note_sck(&then, level, mosi);
    if (then.step == SIM_NODE_ODD) {
        sim_node_record_leave(node);
        return false;
    }
    node->came = then;
    *miso = node->quick.record >> (LINK_BITS - then.bits) & 1u;
    return true;
}

static bool sim_node_record_near(uint16_t before, uint16_t now)
{
    return (unsigned)(now > before ? now - before : before - now) <= SAMPLER_STEP_MOST;
}

/* Frames after which the firmware waits for its sensor are for the registers. */
static bool sim_node_record_is_good(const struct sampler *sampler, const uint8_t *frame)
{
    const struct sensor_reading reading = sensor_frame_decode(frame);
    return reading.status == 0 && sim_node_record_near(sampler->alpha, reading.alpha) &&
           sim_node_record_near(sampler->beta, reading.beta);
}

static void sim_node_record_pack(struct sim_node_quick *quick)
{
    uint16_t words[LINK_WORDS];
    record_pack(&quick->now.reading, quick->now.tick, words);
    quick->record = 0;
    for (unsigned i = 0; i < LINK_WORDS; i++)
        quick->record = quick->record << 16 | words[i];
}

static bool sim_node_record_read(struct sim_node *node)
{
    struct sim_node_quick *quick = &node->quick;
    const struct mlx90333_sense sense = node->sensor.sense;
    struct order order;
    if (node->came.step != SIM_NODE_ENDED || !sim_node_record_parse(node->came.order, &order))
        return false;
    sim_node_sensor_set_field(&node->sensor, node->tick_fs, node->came.field);
    const uint8_t *frame = mlx90333_read(&node->sensor, node->tick_fs / DSPIC_FS_PER_NS + quick->latch_ns);
    if (!sim_node_record_is_good(&quick->now.sampler, frame)) {
        sim_node_record_put_sense(&node->sensor, &sense);
        return false;
    }
    quick->before = quick->now;
    quick->before.sense = sense;
    quick->last = node->came;
    struct sampler *sampler = &quick->now.sampler;
    memcpy(sampler->frame, frame, sizeof sampler->frame);
    sampler->count = MLX90333_FRAME_BYTES - 1u;
    sampler->state = SAMPLER_BYTE;
    (void)sampler_on_byte(sampler, frame[MLX90333_FRAME_BYTES - 1u], &quick->now.reading);
    quick->now.tick = order.tick;
    sim_node_record_pack(quick);
    quick->ticks++;
    node->came.step = SIM_NODE_ASLEEP;
    node->tick_fs += SIM_NODE_TICK_FS;
    return true;
}

static bool sim_node_record_run(struct sim_node *node)
{
    const bool taken = sim_node_record_read(node);
    if (!taken)
        sim_node_record_leave(node);
    return taken;
}

void sim_node_by_records(sim_node *node, bool allowed)
{
    static const struct sim_node_level RECORDS = {sim_node_record_enter,  sim_node_record_leave, sim_node_record_sync,
                                                  sim_node_record_select, sim_node_record_sck,   sim_node_record_run};
    if (node->quick.on)
        sim_node_record_leave(node);
    node->quick.level = allowed ? &RECORDS : NULL;
    node->quick.until_check = (unsigned)(1u + node->parameters.chip.seed % CHECK_TICKS);
}
