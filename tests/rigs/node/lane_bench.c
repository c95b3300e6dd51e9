#include "lane_bench.h"

#include <string.h>

#include "whisker_protocol.h"

#define CYCLE_FS (UINT64_C(1000000000000000) / WHISKER_LIMIT_CLOCK_HZ)
#define BITS (8u * WHISKER_RECORD_BYTES)
enum { SETUP_CYCLES = 9, HOLD_CYCLES = 4 }; /* node_link.v */
#define GLITCH_FS (200u * DSPIC_FS_PER_NS)

struct lane_timing lane_timing_of(unsigned sck_divider, unsigned word_gap, unsigned tick_period)
{
    return (struct lane_timing){.half_fs = sck_divider / 2u * CYCLE_FS,
                                .gap_fs = word_gap * CYCLE_FS,
                                .setup_fs = SETUP_CYCLES * CYCLE_FS,
                                .hold_fs = HOLD_CYCLES * CYCLE_FS,
                                .period_fs = tick_period * CYCLE_FS};
}

enum { SYNC_EDGE, SELECT_EDGE, SCK_EDGE, START, READ, BREAK, BEGIN, END };

static void lane_bench_add(struct lane_bench *bench, uint64_t at_fs, unsigned what, bool level, bool mosi)
{
    unsigned i = bench->planned;
    if (i == LANE_EVENTS)
        return;
    for (; i > 0 && bench->events[i - 1u].at_fs > at_fs; i--)
        bench->events[i] = bench->events[i - 1u];
    bench->events[i] = (struct lane_event){at_fs, (uint8_t)what, level, mosi};
    bench->planned++;
}

static void lane_bench_start_transfer(struct lane_bench *bench)
{
    const bool overlapped = bench->arms_at_end != bench->first.arms;
    bench->first = sim_node_report(bench->node);
    bench->stale = overlapped && bench->first.arms == bench->arms_at_end;
}

static void lane_bench_read_bit(struct lane_bench *bench)
{
    bench->read++;
    bench->record = bench->record << 1 | sim_node_miso(bench->node);
    if (bench->read == BITS)
        bench->arms = sim_node_report(bench->node).arms;
}

/* A disturbance may not return: whatever comes after it must be planned by now. */
static void lane_bench_perform(struct lane_bench *bench, const struct lane_event *e, const struct lane_faults *f)
{
    switch (e->what) {
    case BEGIN:
        bench->report = sim_node_report(bench->node);
        sim_node_field(bench->node, bench->fields[bench->tick & 1u]);
        sim_node_sensor_fault(bench->node, f->sensor, f->sensor_argument);
        break;
    case SYNC_EDGE:
        sim_node_pin(bench->node, SIM_NODE_SYNC, e->level, e->at_fs);
        break;
    case SELECT_EDGE:
        sim_node_pin(bench->node, SIM_NODE_SELECT, e->level, e->at_fs);
        break;
    case SCK_EDGE:
        sim_node_pin(bench->node, SIM_NODE_MOSI, e->mosi, e->at_fs);
        sim_node_pin(bench->node, SIM_NODE_SCK, e->level, e->at_fs);
        break;
    case START:
        lane_bench_start_transfer(bench);
        break;
    case READ:
        lane_bench_read_bit(bench);
        break;
    case BREAK:
        sim_node_disturb(bench->node, f->disturbance, f->disturbance_argument);
        break;
    default:
        break;
    }
}

uint64_t lane_order(uint8_t tick)
{
    uint8_t order[WHISKER_ORDER_BYTES] = {0};
    uint64_t bits = 0;
    order[WHISKER_ORDER_TICK] = tick;
    order[WHISKER_ORDER_COMMAND] = WHISKER_COMMAND_SAMPLE;
    order[WHISKER_ORDER_CRC] = whisker_crc8(order, WHISKER_ORDER_CRC);
    for (unsigned i = 0; i < WHISKER_ORDER_BYTES; i++)
        bits = bits << 8 | order[i];
    return bits;
}

/* The bridge reads MISO just before the falling edge. */
static void lane_bench_plan_bit(struct lane_bench *bench, unsigned i, bool mosi, bool reaches_node, uint64_t at_fs)
{
    if (reaches_node)
        lane_bench_add(bench, at_fs, SCK_EDGE, true, mosi);
    if (i < BITS)
        lane_bench_add(bench, at_fs + bench->timing.half_fs, READ, false, false);
    if (reaches_node)
        lane_bench_add(bench, at_fs + bench->timing.half_fs, SCK_EDGE, false, mosi);
}

static void lane_bench_plan_transfer(struct lane_bench *bench, uint64_t select_fs)
{
    const struct lane_timing *t = &bench->timing;
    const struct lane_faults *f = &bench->faults;
    const unsigned clocks = (unsigned)((int32_t)BITS + f->extra_clocks);
    const uint64_t order = lane_order((uint8_t)bench->tick) ^ f->mosi_flips;
    uint64_t at = select_fs + t->setup_fs;
    lane_bench_add(bench, select_fs, START, false, false);
    if (!f->no_select)
        lane_bench_add(bench, select_fs, SELECT_EDGE, false, false);
    for (unsigned i = 0; i < clocks || i < BITS; i++) {
        if (i > 0 && i == f->glitch_bit) {
            lane_bench_add(bench, at - GLITCH_FS, SELECT_EDGE, true, false);
            lane_bench_add(bench, at - GLITCH_FS / 2u, SELECT_EDGE, false, false);
        }
        const bool sent = i < BITS && order >> (BITS - 1u - i) & 1u;
        lane_bench_plan_bit(bench, i, f->mosi_stuck ? f->mosi_level : sent, i < clocks, at);
        at += 2u * t->half_fs + (i % 16u == 15u ? t->gap_fs : 0u);
    }
    if (!f->select_stays)
        lane_bench_add(bench, at + t->hold_fs, SELECT_EDGE, true, false);
    lane_bench_add(bench, at + t->hold_fs, END, false, false);
}

static void lane_bench_plan_sync(struct lane_bench *bench, uint64_t at_fs)
{
    lane_bench_add(bench, at_fs, SYNC_EDGE, true, false);
    lane_bench_add(bench, at_fs + bench->timing.gap_fs, SYNC_EDGE, false, false);
}

static void lane_bench_plan_tick(struct lane_bench *bench, uint64_t sync_fs)
{
    const struct lane_faults *f = &bench->faults;
    bench->planned = bench->done = 0;
    bench->record = 0;
    bench->read = 0;
    lane_bench_add(bench, sync_fs, BEGIN, false, false);
    if (!f->no_sync)
        lane_bench_plan_sync(bench, sync_fs);
    lane_bench_plan_transfer(bench, sync_fs + bench->timing.gap_fs);
    if (f->second_sync_ns > 0)
        lane_bench_plan_sync(bench, sync_fs + f->second_sync_ns * DSPIC_FS_PER_NS);
    if (f->disturbance != SIM_NODE_NOTHING)
        lane_bench_add(bench, sync_fs + f->disturbance_ns * DSPIC_FS_PER_NS, BREAK, false, false);
}

static uint64_t lane_bench_as_read(const struct lane_bench *bench)
{
    const struct lane_faults *f = &bench->faults;
    return f->miso_stuck ? (f->miso_level ? ~UINT64_C(0) : 0u) : bench->record ^ f->miso_flips;
}

static bool lane_bench_is_field(const struct lane_verdict *v, struct sim_field field)
{
    return v->alpha == sim_counts(field.alpha_deg) && v->beta == sim_counts(field.beta_deg);
}

/* `expected`: number of the tick that the record should be of. */
static struct lane_verdict lane_bench_judge(const struct lane_bench *bench, uint64_t bits, uint8_t expected)
{
    uint8_t record[WHISKER_RECORD_BYTES];
    struct lane_verdict v = {.sync_fs = bench->next_fs - bench->timing.period_fs,
                             .report = bench->report,
                             .armed = bench->first.record,
                             .read = bits,
                             .rearmed = bench->stale || bench->arms != bench->first.arms,
                             .overlapped = bench->arms_at_end != bench->first.arms};
    for (unsigned i = 0; i < sizeof record; i++)
        record[i] = (uint8_t)(bits >> (BITS - 8u - 8u * i));
    if (bits == ~UINT64_C(0)) {
        v.code = WHISKER_CODE_ABSENT;
    } else if (whisker_crc8(record, WHISKER_RECORD_CRC) != record[WHISKER_RECORD_CRC]) {
        v.code = WHISKER_CODE_LINK_CRC;
    } else if (record[WHISKER_RECORD_TICK] != expected) {
        v.code = WHISKER_CODE_LINK_TICK;
    } else {
        v.status = whisker_get_u16(record + WHISKER_RECORD_STATUS);
        v.code = (uint8_t)(v.status >> WHISKER_STATUS_CODE_SHIFT);
        v.alpha = whisker_get_u16(record + WHISKER_RECORD_ALPHA);
        v.beta = whisker_get_u16(record + WHISKER_RECORD_BETA);
        v.good = v.status == 0;
        v.altered = v.good && !lane_bench_is_field(&v, bench->fields[expected & 1u]);
    }
    return v;
}

static void lane_bench_judge_tick(struct lane_bench *bench)
{
    const struct lane_verdict verdict = lane_bench_judge(bench, lane_bench_as_read(bench), (uint8_t)(bench->tick - 1u));
    bench->world.judged(bench->world.context, bench->tick, &verdict);
    bench->tick++;
    bench->next_fs += bench->timing.period_fs;
}

/* A tick begins when the one before is over, however early its SYNC would come. */
static uint64_t lane_bench_begins_at(const struct lane_bench *bench)
{
    const uint64_t now = sim_node_fs(bench->node);
    const uint64_t at = bench->next_fs + (uint64_t)((int64_t)bench->faults.shift_ns * (int64_t)DSPIC_FS_PER_NS);
    return at > now ? at : now;
}

static void lane_bench_begin_tick(struct lane_bench *bench)
{
    bench->faults = (struct lane_faults){0};
    bench->ended =
        !bench->world.plan(bench->world.context, bench->tick, &bench->fields[bench->tick & 1u], &bench->faults);
    if (!bench->ended)
        lane_bench_plan_tick(bench, lane_bench_begins_at(bench));
}

static void lane_bench_act(void *context)
{
    struct lane_bench *bench = context;
    while (!bench->ended && bench->events[bench->done].at_fs <= sim_node_fs(bench->node)) {
        const struct lane_event e = bench->events[bench->done++];
        const struct lane_faults f = bench->faults;
        if (e.what == END)
            bench->arms_at_end = sim_node_report(bench->node).arms;
        if (bench->done == bench->planned) {
            lane_bench_judge_tick(bench);
            lane_bench_begin_tick(bench);
        }
        if (!bench->ended)
            sim_node_plan(bench->node, bench->events[bench->done].at_fs);
        lane_bench_perform(bench, &e, &f);
    }
}

void lane_bench_start(struct lane_bench *bench, sim_node *node, struct lane_timing timing)
{
    memset(bench, 0, sizeof *bench);
    bench->node = node;
    bench->timing = timing;
    bench->next_fs = sim_node_fs(node) + timing.period_fs / 4u;
    sim_node_outside(node, lane_bench_act, bench);
}

void lane_bench_run(struct lane_bench *bench, const struct lane_world *world)
{
    bench->world = *world;
    lane_bench_begin_tick(bench);
    while (!bench->ended) {
        sim_node_plan(bench->node, bench->events[bench->done].at_fs);
        sim_node_until(bench->node, bench->next_fs + bench->timing.period_fs);
    }
}
