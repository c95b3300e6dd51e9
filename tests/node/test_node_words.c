/* Whole bytes and words, and the sensor without its twin, against the same edge by edge: two nodes of one seed on the
 * test bench, one schedule at times drawn at random, amid bytes and handlers too: faults armed and disarmed, supplies,
 * resets, fields, SYNCs, and a bridge that is cut short. Whatever can be seen is written down, and compared. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "dspic33fj128mc802.h" // RCON_*
#include "lane_bench.h"        // lane_order
#include "sim_rng.h"
#include "update_bench.h"

enum { EDGES, WHOLE, WAYS };
enum { SEEDS = 24, TICKS = 600, ACTIONS = 400, ENTRIES = 1 << 18 };

#define US_FS (1000u * DSPIC_FS_PER_NS)
#define TICK_FS (SIM_TICK_NS * DSPIC_FS_PER_NS)

enum what { PIN, READ, FIELD, FAULT, DISTURB, LOOK };
struct action {
    uint64_t at_fs;
    enum what what;
    unsigned argument, value;
};

/* One node under the schedule of its seed. */
struct run {
    sim_node *node;
    uint64_t random;
    unsigned odd; /* one tick in so many has a fault */
    struct action actions[ACTIONS];
    unsigned planned, done;
    uint64_t *entries; /* all that was seen, in its order */
    unsigned seen;
};

static unsigned draw(struct run *run, unsigned bound)
{
    return (unsigned)(sim_rng_mix(&run->random) % bound);
}

static void see(struct run *run, uint64_t value)
{
    assert_true(run->seen < ENTRIES);
    run->entries[run->seen++] = value;
}

static void see_report(struct run *run)
{
    const struct sim_node_report r = sim_node_report(run->node);
    const uint64_t all[] = {sim_node_fs(run->node),
                            r.frame.line,
                            r.frame.sent,
                            r.frame.number,
                            r.frame.begun_fs,
                            r.frame.slip,
                            r.frame.followed,
                            r.frame.alpha_before,
                            r.frame.beta_before,
                            r.record,
                            r.arms,
                            r.latch_fs,
                            r.age_fs,
                            r.armed_fs,
                            r.busy_fs,
                            r.interrupts,
                            r.fcy_hz,
                            r.overwritten};
    for (unsigned i = 0; i < sizeof all / sizeof *all; i++)
        see(run, all[i]);
}

static void see_counts(struct run *run)
{
    see(run, sim_node_violations(run->node));
    for (unsigned counter = 0; counter < WHISKER_HEALTH_COUNT; counter++)
        see(run, sim_node_counted(run->node, counter));
}

static void plan(struct run *run, uint64_t at_fs, enum what what, unsigned argument, unsigned value)
{
    unsigned i = run->planned++;
    assert_true(i < ACTIONS);
    for (; i > 0 && run->actions[i - 1u].at_fs > at_fs; i--)
        run->actions[i] = run->actions[i - 1u];
    run->actions[i] = (struct action){at_fs, what, argument, value};
}

static void perform(struct run *run, const struct action *a)
{
    switch (a->what) {
    case PIN:
        sim_node_pin(run->node, (enum sim_node_pin)a->argument, a->value != 0, a->at_fs);
        break;
    case READ:
        see(run, sim_node_miso(run->node));
        break;
    case FIELD:
        sim_node_field(run->node, (struct sim_field){0.01 * a->argument - 60.0, 60.0 - 0.01 * a->value});
        break;
    case FAULT:
        sim_node_sensor_fault(run->node, (enum sim_sensor_fault)a->argument, a->value);
        break;
    case DISTURB:
        sim_node_disturb(run->node, (enum sim_node_disturbance)a->argument, a->value);
        break;
    default:
        see_report(run);
        see_counts(run);
    }
}

/* A disturbance may not return: what comes after it is planned by then. */
static void act(void *context)
{
    struct run *run = context;
    while (run->done < run->planned && run->actions[run->done].at_fs <= sim_node_fs(run->node)) {
        const struct action a = run->actions[run->done++];
        if (run->done < run->planned)
            sim_node_plan(run->node, run->actions[run->done].at_fs);
        perform(run, &a);
    }
}

static void plan_transfer(struct run *run, uint64_t at_fs, uint8_t tick, bool odd)
{
    const uint64_t order = lane_order(tick) ^ (odd && draw(run, 3) == 0 ? UINT64_C(1) << draw(run, 64) : 0u);
    const unsigned bits = odd && draw(run, 3) == 0 ? draw(run, 80) : 64u;
    const uint64_t half_fs = (130u + draw(run, 300)) * DSPIC_FS_PER_NS;
    plan(run, at_fs, PIN, SIM_NODE_SELECT, 0);
    at_fs += 150u * DSPIC_FS_PER_NS;
    for (unsigned i = 0; i < bits; i++) {
        plan(run, at_fs, PIN, SIM_NODE_MOSI, i < 64u && order >> (63u - i) & 1u);
        plan(run, at_fs, PIN, SIM_NODE_SCK, 1);
        plan(run, at_fs + half_fs, READ, 0, 0);
        plan(run, at_fs + half_fs, PIN, SIM_NODE_SCK, 0);
        at_fs += 2u * half_fs + (i % 16u == 15u ? 3u * US_FS : 0u);
    }
    plan(run, at_fs, PIN, SIM_NODE_SELECT, 1);
}

static void plan_sync(struct run *run, uint64_t at_fs)
{
    plan(run, at_fs, PIN, SIM_NODE_SYNC, 1);
    plan(run, at_fs + 2u * US_FS, PIN, SIM_NODE_SYNC, 0);
}

/* Within a tick; often there, where the frame's bytes are. */
static uint64_t any_time(struct run *run, uint64_t begin_fs)
{
    return begin_fs + draw(run, draw(run, 2) ? 400000 : 496000) * DSPIC_FS_PER_NS;
}

static void plan_fault(struct run *run, uint64_t begin_fs)
{
    const unsigned kind = 1u + draw(run, SIM_SENSOR_EXTRA_CLOCK);
    const unsigned argument = kind == SIM_SENSOR_FLIP_TWO ? draw(run, 64) | draw(run, 64) << 8 : draw(run, 64);
    plan(run, any_time(run, begin_fs), FAULT, kind, kind == SIM_SENSOR_NOISY ? 2000u : argument);
    if (draw(run, 2))
        plan(run, any_time(run, begin_fs), FAULT, SIM_SENSOR_GOOD, 0);
}

static void plan_disturbance(struct run *run, uint64_t begin_fs)
{
    static const struct {
        enum sim_node_disturbance what;
        unsigned argument;
    } KINDS[] = {{SIM_NODE_TRAP, DSPIC_TRAP_MATH},
                 {SIM_NODE_RESET, RCON_EXTR},
                 {SIM_NODE_RESET, RCON_BOR},
                 {SIM_NODE_UNREAD, 1},
                 {SIM_NODE_UNREAD, 2},
                 {SIM_NODE_COLLISION, 1},
                 {SIM_NODE_SENSOR_OFF, 0},
                 {SIM_NODE_SENSOR_ON, 0},
                 {SIM_NODE_DARK, 0},
                 {SIM_NODE_LIGHT, 0}};
    const unsigned n = draw(run, sizeof KINDS / sizeof *KINDS);
    plan(run, any_time(run, begin_fs), DISTURB, KINDS[n].what, KINDS[n].argument);
}

/* What was switched off comes back before long. */
static void plan_repair(struct run *run, uint64_t begin_fs)
{
    plan(run, any_time(run, begin_fs), DISTURB, draw(run, 2) ? SIM_NODE_LIGHT : SIM_NODE_SENSOR_ON, 0);
    plan(run, any_time(run, begin_fs), FAULT, SIM_SENSOR_GOOD, 0);
}

static void plan_tick(struct run *run, uint64_t begin_fs, unsigned tick)
{
    const unsigned odd = draw(run, run->odd) == 0 ? 1u + draw(run, 8) : 0;
    run->planned = run->done = 0;
    plan(run, begin_fs, FIELD, draw(run, 12000), draw(run, 12000));
    if (odd != 1)
        plan_sync(run, begin_fs + (odd == 2 ? draw(run, 90) * US_FS : 0u));
    if (odd == 3)
        plan_sync(run, any_time(run, begin_fs));
    if (odd != 4)
        plan_transfer(run, begin_fs + 3u * US_FS, (uint8_t)tick, odd == 5);
    if (odd >= 6)
        plan_fault(run, begin_fs);
    if (odd == 8)
        plan_disturbance(run, begin_fs);
    if (draw(run, 60) == 0)
        plan_repair(run, begin_fs);
    plan(run, any_time(run, begin_fs), LOOK, 0, 0);
    plan(run, begin_fs + TICK_FS - 1u, LOOK, 0, 0);
}

/* Awake so late that of the firmware's first pause of /SS, 350 us at the end of its start, half is over. */
static uint32_t late_startup_ns(const struct sim_node_parameters *parts)
{
    sim_node *node = sim_node_new_as(parts);
    sim_node_power_on(node);
    const uint64_t ready_fs = sim_node_fs(node);
    sim_node_free(node);
    return (uint32_t)((ready_fs - 180u * US_FS) / DSPIC_FS_PER_NS * 1000u / parts->sensor.slow_permille);
}

/* Parts as they may be, some of them slower than the firmware waits for: then chance and breaches are compared too. */
static sim_node *node_of(uint64_t seed, unsigned way)
{
    struct sim_node_parameters parts;
    uint64_t random = seed;
    sim_node_parameters_default(&parts, seed);
    parts.chip.frc_ppm = (int32_t)(sim_rng_mix(&random) % 40001u) - 20000;
    parts.chip.slave_prefetch = (uint8_t)(1u + sim_rng_mix(&random) % 2u);
    parts.chip.dma_cycles = (uint8_t)(sim_rng_mix(&random) % 13u);
    if (seed % 7u == 0)
        parts.sensor.slow_permille = 1400;
    else if (seed % 5u == 0)
        parts.sensor.startup_ns = late_startup_ns(&parts);
    parts.sensor.conversion_ns = seed % 2u ? 350000u : 0u;
    parts.sensor.noise_deg = seed % 4u ? 0.0 : 0.1;
    parts.sensor.filter = (uint8_t)(seed % 6u);
    parts.sensor.resets_after_error = seed % 3u == 0;
    sim_node *node = sim_node_new_as(&parts);
    if (way == EDGES)
        sim_node_by_edges(node);
    sim_node_power_on(node);
    return node;
}

static struct run run_of(uint64_t seed, unsigned way)
{
    static const unsigned ODD[] = {2, 5, 20};
    struct run run = {.node = node_of(seed, way), .random = seed, .odd = ODD[seed % 3u]};
    run.entries = calloc(ENTRIES, sizeof *run.entries);
    assert_non_null(run.entries);
    return run;
}

static void run_ticks(struct run *run)
{
    const uint64_t begin_fs = sim_node_fs(run->node) + 50u * US_FS;
    sim_node_outside(run->node, act, run);
    for (unsigned tick = 0; tick < TICKS; tick++) {
        plan_tick(run, begin_fs + tick * TICK_FS, tick);
        sim_node_plan(run->node, run->actions[0].at_fs);
        while (run->done < run->planned)
            sim_node_until(run->node, run->actions[run->done].at_fs);
    }
}

static void random_schedules_look_the_same(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        struct run runs[WAYS];
        for (unsigned way = 0; way < WAYS; way++) {
            runs[way] = run_of(seed, way);
            run_ticks(&runs[way]);
        }
        assert_int_equal(runs[WHOLE].seen, runs[EDGES].seen);
        for (unsigned i = 0; i < runs[EDGES].seen; i++)
            assert_int_equal(runs[WHOLE].entries[i], runs[EDGES].entries[i]);
        for (unsigned way = 0; way < WAYS; way++) {
            sim_node_free(runs[way].node);
            free(runs[way].entries);
        }
    }
}

/* An update whose supply fails at a block, and which is then brought to its end. */
static void updates_end_the_same(void **state)
{
    (void)state;
    static struct update_image image;
    image = update_image_of(UPDATE_VERSION);
    for (uint64_t seed = 1; seed <= 4; seed++) {
        struct update_bench benches[WAYS];
        int ends[WAYS][2];
        for (unsigned way = 0; way < WAYS; way++) {
            struct update_bench *b = &benches[way];
            assert_true(update_begin(b, seed, 5, WHISKER_LIMIT_CHIP_ID));
            if (way == EDGES)
                sim_node_by_edges(b->node);
            update_ticks(b, 20);
            b->cut.due = true;
            b->cut.command = WHISKER_SERVICE_COMMAND_BLOCK;
            b->cut.block = (uint16_t)(3u * seed);
            b->cut.after_ns = 1000u * (100u + 97u * (uint32_t)seed);
            ends[way][0] = update_run(b, &image, 5);
            if (sim_node_dark(b->node))
                sim_node_restore(b->node);
            update_ticks(b, 200);
            ends[way][1] = update_run(b, &image, 5);
            update_ticks(b, 200);
        }
        assert_memory_equal(ends[WHOLE], ends[EDGES], sizeof ends[WHOLE]);
        assert_int_equal(benches[WHOLE].ticks, benches[EDGES].ticks);
        assert_memory_equal(benches[WHOLE].record, benches[EDGES].record, sizeof benches[WHOLE].record);
        assert_int_equal(sim_node_version(benches[WHOLE].node), sim_node_version(benches[EDGES].node));
        assert_int_equal(sim_node_fs(benches[WHOLE].node), sim_node_fs(benches[EDGES].node));
        for (unsigned way = 0; way < WAYS; way++)
            sim_node_free(benches[way].node);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_schedules_look_the_same),
        cmocka_unit_test(updates_end_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
