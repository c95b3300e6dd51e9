/* When a sample is taken, and how old it then is: the protocol's stated uncertainty holds on slow and quick parts. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "lane_bench.h"
#include "whisker_protocol.h"

enum { TICKS = 3000, CONVERSION_NS = 350000, LATCH_SPREAD_NS = 1000 };

struct run {
    uint64_t youngest_ns, oldest_ns, soonest_ns, latest_ns;
};

static bool plan(void *context, unsigned tick, struct sim_field *field, struct lane_faults *faults)
{
    (void)context;
    (void)faults;
    *field = (struct sim_field){0.01 * (tick % 100u), 0.0};
    return tick < TICKS;
}

static void widen(uint64_t *least, uint64_t *most, uint64_t value)
{
    *least = value < *least ? value : *least;
    *most = value > *most ? value : *most;
}

static void judged(void *context, unsigned tick, const struct lane_verdict *v)
{
    struct run *run = context;
    if (tick < 2)
        return;
    widen(&run->youngest_ns, &run->oldest_ns, v->report.age_fs / DSPIC_FS_PER_NS);
    widen(&run->soonest_ns, &run->latest_ns, (v->report.latch_fs - v->sync_fs) / DSPIC_FS_PER_NS);
}

static struct run run_parts(int32_t chip_ppm, uint16_t sensor_permille)
{
    struct run run = {.youngest_ns = UINT64_MAX, .soonest_ns = UINT64_MAX};
    struct sim_node_parameters parts;
    struct lane_bench bench;
    sim_node_parameters_default(&parts, 1);
    parts.chip.frc_ppm = chip_ppm;
    parts.sensor.slow_permille = sensor_permille;
    parts.sensor.conversion_ns = CONVERSION_NS;
    sim_node *node = sim_node_new_as(&parts);
    sim_node_power_on(node);
    lane_bench_start(&bench, node, lane_timing_of(16, 180, WHISKER_LIMIT_TICK_PERIOD));
    lane_bench_run(&bench, &(struct lane_world){&run, plan, judged});
    sim_node_free(node);
    return run;
}

static void a_sample_is_no_older_than_the_protocol_says_and_may_be_that_old(void **state)
{
    (void)state;
    const struct run slow = run_parts(0, 1100), quick = run_parts(0, 900);
    assert_true(slow.oldest_ns <= WHISKER_LIMIT_SENSOR_AGE_MAX && quick.oldest_ns <= WHISKER_LIMIT_SENSOR_AGE_MAX);
    assert_true(slow.oldest_ns > WHISKER_LIMIT_SENSOR_AGE_MAX - 10000u);
    assert_true(slow.youngest_ns < WHISKER_LIMIT_SENSOR_AGE_MIN + 10000u);
}

static void it_is_taken_at_the_protocols_time_after_sync(void **state)
{
    (void)state;
    for (int32_t ppm = -40000; ppm <= 40000; ppm += 40000) {
        const struct run run = run_parts(ppm, 1000);
        assert_true(run.soonest_ns + LATCH_SPREAD_NS > WHISKER_LIMIT_SENSOR_LATCH);
        assert_true(run.latest_ns < WHISKER_LIMIT_SENSOR_LATCH + LATCH_SPREAD_NS);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sample_is_no_older_than_the_protocol_says_and_may_be_that_old),
        cmocka_unit_test(it_is_taken_at_the_protocols_time_after_sync),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
