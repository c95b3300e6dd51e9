#include "storm.h"

#include "sim_rng.h"
#include "storm_log.h"
#include "whisker_protocol.h"

enum { SETTLED = 3, MOST_FAULTS = 3, SPREAD = 4 };

#define WEIGHT(name, weight) (weight),
static const unsigned WEIGHTS[] = {STORM_KINDS(WEIGHT)};
#undef WEIGHT

struct storm {
    struct storm_log log;
    struct lane_bench bench;
    uint64_t random;
    struct sim_field field;
    unsigned faults_left; /* of the present schedule */
    unsigned wait;        /* ticks to the next fault */
    unsigned good;        /* records in a row */
    unsigned since;       /* ticks since the last fault */
    enum sim_node_disturbance end;
    unsigned end_in; /* ticks until what is off comes on */
};

static uint32_t storm_below(struct storm *s, uint32_t n)
{
    return (uint32_t)((sim_rng_mix(&s->random) >> 32) * n >> 32);
}

static bool storm_coin(struct storm *s)
{
    return sim_rng_mix(&s->random) >> 63;
}

static enum storm_kind storm_any_kind(struct storm *s)
{
    unsigned sum = 0, kind = 0;
    for (unsigned k = 0; k < STORM_KIND_COUNT; k++)
        sum += WEIGHTS[k];
    for (unsigned at = storm_below(s, sum); at >= WEIGHTS[kind]; kind++)
        at -= WEIGHTS[kind];
    return (enum storm_kind)kind;
}

static uint64_t storm_bits(struct storm *s, unsigned count)
{
    uint64_t set = 0;
    while (count-- > 0)
        set |= UINT64_C(1) << storm_below(s, 64);
    return set;
}

#define ASSIGNED(name, bit, sensor_bit, cause, remedy) | 1u << (sensor_bit)
#define ASSIGNED_ERRORS (0u WHISKER_SENSOR_ERRORS(ASSIGNED))

/* Faults of the sensor and its line. */
static void storm_break_sensor(struct storm *s, enum storm_kind kind, struct lane_faults *f)
{
    static const uint8_t FAULT[] = {SIM_SENSOR_FLIP_BIT,   SIM_SENSOR_FLIP_TWO,   SIM_SENSOR_NOISY,
                                    SIM_SENSOR_FLOATING,   SIM_SENSOR_DEAD,       SIM_SENSOR_STUCK_LOW,
                                    SIM_SENSOR_ERROR_BITS, SIM_SENSOR_LOST_CLOCK, SIM_SENSOR_EXTRA_CLOCK};
    f->sensor = (enum sim_sensor_fault)FAULT[kind];
    f->sensor_argument = storm_below(s, 64);
    if (kind == STORM_FLIP_TWO)
        f->sensor_argument |= (f->sensor_argument + 1u + storm_below(s, 63)) % 64u << 8;
    if (kind == STORM_NOISY)
        f->sensor_argument = 1024u << storm_below(s, 5);
    if (kind == STORM_ERROR_BITS)
        f->sensor_argument = (uint32_t)sim_rng_mix(&s->random) & ASSIGNED_ERRORS;
}

/* Faults of the link and its timing. */
static void storm_break_link(struct storm *s, enum storm_kind kind, struct lane_faults *f)
{
    f->no_sync = kind == STORM_NO_SYNC;
    f->no_select = kind == STORM_NO_SELECT;
    f->select_stays = kind == STORM_SELECT_STAYS;
    f->second_sync_ns = kind == STORM_SECOND_SYNC ? 4000u + storm_below(s, 490000) : 0u;
    f->shift_ns = kind == STORM_SHIFT ? (int32_t)storm_below(s, 600000) - 300000 : 0;
    f->mosi_flips = kind == STORM_MOSI_FLIPS ? storm_bits(s, 1u + storm_below(s, 8)) : 0u;
    f->miso_flips = kind == STORM_MISO_FLIPS ? storm_bits(s, 1u + storm_below(s, 8)) : 0u;
    f->extra_clocks = kind == STORM_CLOCKS ? (int32_t)storm_below(s, 105) - 64 : 0;
    f->glitch_bit = (uint8_t)(kind == STORM_GLITCH ? 1u + storm_below(s, 63) : 0u);
    f->miso_stuck = kind == STORM_MISO_STUCK;
    f->mosi_stuck = kind == STORM_MOSI_STUCK;
    f->miso_level = f->mosi_level = storm_coin(s);
}

static void storm_disturb(struct storm *s, struct lane_faults *f, enum sim_node_disturbance what, unsigned argument)
{
    f->disturbance = what;
    f->disturbance_argument = argument;
    f->disturbance_ns = storm_below(s, 500000);
}

static void storm_break_chip(struct storm *s, enum storm_kind kind, struct lane_faults *f)
{
    static const uint16_t CAUSES[] = {RCON_BOR, RCON_EXTR, RCON_IOPUWR, RCON_SWR};
    switch (kind) {
    case STORM_UNREAD:
        storm_disturb(s, f, SIM_NODE_UNREAD, 1u + storm_below(s, 2));
        break;
    case STORM_RESET:
        storm_disturb(s, f, SIM_NODE_RESET, CAUSES[storm_below(s, 4)]);
        break;
    case STORM_TRAP:
        storm_disturb(s, f, SIM_NODE_TRAP, storm_below(s, 5));
        break;
    case STORM_COLLISION:
        storm_disturb(s, f, SIM_NODE_COLLISION, storm_below(s, 2) + 256u * storm_coin(s));
        break;
    case STORM_HANG:
        storm_disturb(s, f, SIM_NODE_HANG, 0);
        break;
    case STORM_SENSOR_OFF:
    case STORM_DARK:
        storm_disturb(s, f, kind == STORM_DARK ? SIM_NODE_DARK : SIM_NODE_SENSOR_OFF, 0);
        s->end = kind == STORM_DARK ? SIM_NODE_LIGHT : SIM_NODE_SENSOR_ON;
        s->end_in = 1u + storm_below(s, 8);
        break;
    default:
        break;
    }
}

static enum storm_kind storm_strike(struct storm *s, struct lane_faults *f)
{
    const enum storm_kind kind = storm_any_kind(s);
    s->since = 0;
    if (kind <= STORM_EXTRA_CLOCK)
        storm_break_sensor(s, kind, f);
    else if (kind <= STORM_MOSI_STUCK)
        storm_break_link(s, kind, f);
    else
        storm_break_chip(s, kind, f);
    return kind;
}

/* A whisker's angle: never twice the same, never further in a tick than a whisker can move. */
static double storm_walk(struct storm *s, double angle_deg)
{
    const double by = 0.1 + 7.9 * (double)storm_below(s, 1u << 20) / (1u << 20);
    const double to = storm_coin(s) ? angle_deg + by : angle_deg - by;
    return to > 60.0 || to < -60.0 ? angle_deg - (to - angle_deg) : to;
}

/* What breaks in this tick; false: nothing. */
static bool storm_break_something(struct storm *s, enum storm_kind *kind, struct lane_faults *faults)
{
    if (s->end_in > 0) { /* nothing more breaks while something is off */
        if (--s->end_in == 0) {
            faults->disturbance = s->end;
            s->since = 0;
        }
    } else if (s->faults_left > 0 && s->wait-- == 0) {
        *kind = storm_strike(s, faults);
        s->faults_left--;
        s->wait = storm_below(s, SPREAD);
        return true;
    } else if (s->faults_left == 0 && s->good >= SETTLED && s->since > SETTLED) {
        s->log.counts.schedules++;
        s->faults_left = 1u + storm_below(s, MOST_FAULTS);
        s->wait = storm_below(s, SPREAD);
    }
    return false;
}

static bool storm_plan(void *context, unsigned tick, struct sim_field *field, struct lane_faults *faults)
{
    struct storm *s = context;
    enum storm_kind kind = STORM_FLIP_BIT;
    (void)tick;
    s->field = (struct sim_field){storm_walk(s, s->field.alpha_deg), storm_walk(s, s->field.beta_deg)};
    *field = s->field;
    s->since++;
    const bool any = storm_break_something(s, &kind, faults);
    storm_log_deed(&s->log, any, kind, faults);
    s->log.counts.stuck += s->since > STORM_PATIENCE;
    return s->log.counts.schedules <= STORM_SCHEDULES && s->since <= STORM_PATIENCE;
}

static void storm_judged(void *context, unsigned tick, const struct lane_verdict *v)
{
    struct storm *s = context;
    if (tick == 0)
        return;
    s->log.counts.spurious += !v->good && s->good >= SETTLED && s->since > SETTLED;
    s->good = storm_log_verdict(&s->log, tick, v) ? s->good + 1u : 0u;
}

static struct sim_node_parameters storm_any_parts(struct storm *s)
{
    struct sim_node_parameters parts;
    sim_node_parameters_default(&parts, sim_rng_mix(&s->random));
    parts.chip.slave_prefetch = (uint8_t)(1u + storm_below(s, 2));
    parts.chip.dma_cycles = (uint8_t)storm_below(s, 13);
    parts.chip.frc_ppm = (int32_t)storm_below(s, 40001) - 20000;
    parts.sensor.slow_permille = (uint16_t)(900u + storm_below(s, 201));
    return parts;
}

struct storm_counts storm_batch(uint64_t seed)
{
    struct storm s = {.random = seed * UINT64_C(0xD1342543DE82EF95) + 1u};
    const struct sim_node_parameters parts = storm_any_parts(&s);
    sim_node *node = sim_node_new_as(&parts);
    if (!node)
        return s.log.counts;
    sim_node_power_on(node);
    lane_bench_start(&s.bench, node, lane_timing_of(16, 180, WHISKER_LIMIT_TICK_PERIOD));
    lane_bench_run(&s.bench, &(struct lane_world){&s, storm_plan, storm_judged});
    s.log.counts.schedules -= s.log.counts.schedules > STORM_SCHEDULES;
    s.log.counts.violations += sim_node_violations(node) - sim_node_report(node).overwritten;
    sim_node_free(node);
    return s.log.counts;
}
