/* The clock mapping on synthetic traces: an hour of drift and jitter, restarts, steps, and clocks that run apart. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "clock_trace.h"
#include "whisker/clock.h"
#include "whisker/device.h"
#include "whisker/errors.h"

#define HOUR 450000   /* arrivals */
#define MINUTES 15000 /* arrivals: two */
#define REPORT_EVERY 31
#define SETTLED 625 /* five seconds */
#define WANTED_NS 100e3
#define NS_PER_CYCLE (1e9 / TRACE_CLOCK_HZ)
#define STEP_CYCLES 480000u
#define STEP_NS 8000000
#define OFFSET_NS INT64_C(1700000000000000000) /* realtime minus monotonic */

static struct whisker_clock_fit fit;

static int begin(void **state)
{
    (void)state;
    whisker_clock_begin(&fit, TRACE_CLOCK_HZ, TRACE_LATENCY_NS);
    return 0;
}

static int add(uint64_t cycles, int64_t monotonic_ns)
{
    return whisker_clock_add(&fit, cycles, 0, monotonic_ns, monotonic_ns + OFFSET_NS);
}

static struct whisker_clock get(void)
{
    struct whisker_clock clock;
    whisker_clock_get(&fit, &clock);
    return clock;
}

/* Arrivals without jitter, `count` of them from *i on: cycles and the ns that they take at `rate`. */
static void add_steady(uint64_t *i, int count, double rate, int64_t start_ns)
{
    for (const uint64_t end = *i + (uint64_t)count; *i < end; ++*i) {
        add(*i * STEP_CYCLES, start_ns + (int64_t)((double)*i * STEP_NS * rate));
    }
}

static void an_hour_of_drift_and_jitter_stays_within_100_us(void **state)
{
    (void)state;
    for (uint64_t seed = 11; seed < 15; seed++) {
        struct clock_trace trace;
        int covered = 0;
        begin(NULL);
        clock_trace_begin(&trace, seed);
        for (int i = 0; i < HOUR; i++) {
            const struct clock_arrival now = clock_trace_next(&trace);
            assert_int_equal(add(now.cycles, now.arrival_ns), 0);
            const struct whisker_clock clock = get();
            const double error_ns = fabs((double)clock.monotonic_ns - now.true_ns);
            assert_true(i < SETTLED || error_ns < WANTED_NS);
            covered += error_ns <= clock.uncertainty_ns;
        }
        assert_true(covered > HOUR / 100 * 95);
        assert_int_equal(fit.restarts, 0);
    }
}

static void a_mapping_goes_both_ways_in_time_and_to_both_clocks(void **state)
{
    (void)state;
    uint64_t i = 1;
    assert_true(get().ns_per_cycle == 0);
    assert_int_equal(whisker_clock_to_monotonic(&(struct whisker_clock){0}, 5), 0);
    add_steady(&i, 1250, 1 + 50e-6, 1000000000);
    const struct whisker_clock clock = get();
    assert_true(fabs(clock.ns_per_cycle / NS_PER_CYCLE - 1 - 50e-6) < 1e-7);
    for (int64_t k = -600; k <= 600; k += 100) { /* five seconds back and on */
        const double cycles = (double)clock.device_cycles + (double)(k * STEP_CYCLES);
        const double expected_ns = 1e9 + cycles * NS_PER_CYCLE * (1 + 50e-6) - TRACE_LATENCY_NS;
        assert_true(fabs((double)whisker_clock_to_monotonic(&clock, (uint64_t)cycles) - expected_ns) < 2e3);
        assert_int_equal(whisker_clock_to_realtime(&clock, (uint64_t)cycles),
                         whisker_clock_to_monotonic(&clock, (uint64_t)cycles) + OFFSET_NS);
    }
    assert_true(whisker_clock_to_monotonic(&clock, UINT64_MAX / 2) > 0); /* absurd, but no overflow */
}

/* Worst error, us, of the mapping at the arrivals of two minutes after the first five seconds; *covered: the share that
 * the uncertainty holds. */
static double worst_us(struct clock_source source, bool dated, double *covered)
{
    struct clock_trace trace;
    double worst_ns = 0;
    int within = 0;
    begin(NULL);
    clock_trace_begin(&trace, 3);
    trace.source = source;
    trace.usb_skew = 60e-6;
    for (int i = 0; i < MINUTES; i++) {
        const struct clock_arrival now = clock_trace_next(&trace);
        whisker_clock_add(&fit, now.cycles, dated ? now.usb_time : 0, now.arrival_ns, now.arrival_ns);
        if (dated && i % REPORT_EVERY == 0) {
            whisker_clock_report(&fit, now.cycles, now.usb_time, now.sof_cycles);
        }
        const double error_ns = fabs((double)get().monotonic_ns - now.true_ns);
        worst_ns = i < SETTLED ? 0 : fmax(worst_ns, error_ns);
        within += error_ns <= get().uncertainty_ns;
    }
    *covered = (double)within / MINUTES;
    return worst_ns * 1e-3;
}

static void start_of_frame_numbers_date_whatever_ticks(void **state)
{
    (void)state;
    static const struct {
        struct clock_source source;
        double wanted_us, without_us;
    } cases[] = {
        {{.off = 0}, 30, 0},         {{.off = 0.003}, 30, 1000},  {{.uneven = 0.2}, 150, 1000},
        {{.pause_s = 1}, 100, 1000}, {{.restart_s = 20}, 100, 0}, /* without: only known to 60 ms for seconds */
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double covered;
        assert_true(worst_us(cases[i].source, true, &covered) < cases[i].wanted_us);
        assert_true(covered > 0.95);
        assert_int_equal(fit.restarts, 0);
        assert_true(worst_us(cases[i].source, false, &covered) >= cases[i].without_us);
    }
}

static void without_reports_a_date_is_known_to_a_microframe(void **state)
{
    (void)state;
    struct whisker_clock_usb *usb = &fit.usb;
    for (uint64_t i = 0; i < 16; i++) { /* at 50 us of every fourth microframe, from frame number 2047 on */
        const uint16_t usb_time = (uint16_t)(0x8000 | ((0x3FFC + 4 * i) & 0x3FFF));
        whisker_clock_add(&fit, i * 30000, usb_time, (int64_t)i * 500000, 0);
        assert_true(usb->doubt_ns ==
                    (usb->microframes ? 62.5e3 : 500e3)); /* none: a full-speed bus, as far as is known */
    }
    assert_int_equal(usb->microframe, 60 - 4);
    whisker_clock_report(&fit, 16 * 30000, 0x8000 | 60, 3000);
    whisker_clock_report(&fit, 1016 * 30000, 0x8000 | 4060, 3000);
    whisker_clock_report(&fit, 2016 * 30000, 0x8000 | 8060, 3000);
    assert_true(usb->even && usb->doubt_ns == 0);
    assert_true(fabs(usb->rate_ns - NS_PER_CYCLE) < 1e-9);
}

static void a_bus_that_falls_silent_begins_a_new_fit(void **state)
{
    (void)state;
    for (uint64_t i = 0; i < 1000; i++) {
        const uint16_t usb_time = i < 500 ? (uint16_t)(0x8000 | (64 * i & 0x3FFF)) : 0;
        whisker_clock_add(&fit, i * STEP_CYCLES, usb_time, (int64_t)i * STEP_NS, 0);
        assert_true(fabs((double)get().monotonic_ns - ((double)i * STEP_NS - TRACE_LATENCY_NS)) < 1.1e6);
    }
    assert_int_equal(fit.restarts, 1);
}

static void a_bus_whose_time_stood_still_begins_a_new_fit(void **state)
{
    (void)state;
    for (uint64_t i = 0; i < 1000; i++) {
        whisker_clock_add(&fit, i * STEP_CYCLES, (uint16_t)(0x8000 | (64 * i & 0x3FFF)), (int64_t)i * STEP_NS, 0);
    }
    whisker_clock_add(&fit, 0, 0x8000 | (64 * 1000 & 0x3FFF), 1000 * (int64_t)STEP_NS + 500000000, 0);
    assert_int_equal(fit.restarts, 1);
}

static void a_bridge_that_starts_again_begins_a_new_fit(void **state)
{
    (void)state;
    uint64_t i = 1;
    add_steady(&i, 1000, 1, 0);
    assert_int_equal(add(0, 20000000000), 0);
    assert_int_equal(fit.restarts, 1);
    assert_int_equal(get().monotonic_ns, 20000000000 - TRACE_LATENCY_NS);
    assert_true(get().uncertainty_ns > 1e6);
}

static void a_monotonic_clock_that_goes_back_is_reported_and_survived(void **state)
{
    (void)state;
    uint64_t i = 1;
    add_steady(&i, 1000, 1, 0);
    assert_int_equal(add(i * STEP_CYCLES, 1000000000), WHISKER_ERROR_HOST_CLOCK);
    assert_int_equal(add((i + 1) * STEP_CYCLES, 1008000000), 0);
    assert_int_equal(get().monotonic_ns, 1008000000 - TRACE_LATENCY_NS);
}

static void a_realtime_clock_that_is_set_is_reported_and_followed(void **state)
{
    (void)state;
    const int64_t hour_ns = INT64_C(3600000000000);
    uint64_t i = 1;
    add_steady(&i, 1000, 1, 0);
    const int64_t now_ns = (int64_t)i * STEP_NS;
    assert_int_equal(whisker_clock_add(&fit, i * STEP_CYCLES, 0, now_ns, now_ns + OFFSET_NS - hour_ns),
                     WHISKER_ERROR_HOST_CLOCK);
    assert_int_equal(get().realtime_ns - get().monotonic_ns, OFFSET_NS - hour_ns);
    assert_int_equal(fit.restarts, 0); /* the monotonic clock is not touched by it */
    assert_true(get().uncertainty_ns < 1e6);
    assert_int_equal(whisker_clock_add(&fit, (i + 1) * STEP_CYCLES, 0, now_ns + STEP_NS, now_ns + STEP_NS + OFFSET_NS),
                     WHISKER_ERROR_HOST_CLOCK);
}

/* Suspended: the bridge's clock went on while the host's stood still, or the other way round. */
static void clocks_that_jump_apart_begin_a_new_fit(void **state)
{
    (void)state;
    static const int64_t jumps_ns[] = {-3000000000, 3000000000};
    for (size_t k = 0; k < 2; k++) {
        uint64_t i = 1;
        begin(NULL);
        add_steady(&i, 2000, 1, 0);
        add_steady(&i, 1250, 1, jumps_ns[k]);
        const double expected_ns = (double)(i - 1) * STEP_NS + (double)jumps_ns[k] - TRACE_LATENCY_NS;
        assert_true(fabs((double)get().monotonic_ns - expected_ns) < WANTED_NS);
        assert_true(fit.restarts >= 1);
    }
}

static void a_long_stall_moves_nothing(void **state)
{
    (void)state;
    uint64_t i = 1;
    add_steady(&i, 2000, 1, 0);
    for (const uint64_t end = i + 125; i < end; i++) { /* a second's arrivals all come at its end */
        add(i * STEP_CYCLES, (int64_t)end * STEP_NS);
    }
    assert_true(fabs((double)get().monotonic_ns - ((double)(i - 1) * STEP_NS - TRACE_LATENCY_NS)) < 1e3);
    assert_int_equal(fit.restarts, 0);
}

/* How far all points lie above the highest line of this slope that none lies below, summed up. */
static double sum_above(double slope)
{
    double least = INFINITY, sum = 0;
    for (int i = 0; i < fit.points; i++) {
        const double late_ns = fit.point[i].late_ns - slope * fit.point[i].x_ns;
        least = fmin(least, late_ns);
        sum += late_ns;
    }
    return sum - fit.points * least;
}

/* By trying the line through every two points. */
static double least_sum_above(void)
{
    double least = INFINITY;
    for (int b = 1; b < fit.points; b++) {
        for (int a = 0; a < b; a++) {
            const struct whisker_clock_point *p = &fit.point[a], *q = &fit.point[b];
            least = fmin(least, sum_above((q->late_ns - p->late_ns) / (q->x_ns - p->x_ns)));
        }
    }
    return least;
}

static void the_line_lies_closest_below_all_points(void **state)
{
    (void)state;
    uint32_t random = 1;
    for (int i = 0; i < 300; i++) { /* one in each second, up to 100 us late */
        random = random * 1664525u + 1013904223u;
        const double sent_ns = i * 1e9 + 5e8 * (i > 0), late_ns = (random >> 16) * (100e3 / 65536);
        add((uint64_t)(sent_ns / NS_PER_CYCLE), (int64_t)(sent_ns * (1 + 50e-6) + late_ns));
        assert_true(fit.points < 2 || fabs(sum_above(fit.skew) - least_sum_above()) < 1);
    }
    assert_int_equal(fit.points, WHISKER_CLOCK_POINTS);
    assert_int_equal(fit.restarts, 0);
}

/* A simulated bridge has no clock of ours: the mapping must say that it does not know. */
static void a_clock_of_another_rate_is_never_claimed_to_be_known(void **state)
{
    (void)state;
    static const double rates[] = {0.4, 0.9, 1.1, 3};
    for (size_t k = 0; k < sizeof rates / sizeof rates[0]; k++) {
        uint64_t i = 1;
        begin(NULL);
        for (int n = 0; n < 3000; n++) {
            add_steady(&i, 1, rates[k], 0);
            assert_true(get().uncertainty_ns > 10e6);
        }
    }
}

static void the_least_latency_follows_from_the_settings(void **state)
{
    (void)state;
    struct whisker_settings settings;
    whisker_settings_default(&settings);
    /* The next tick, then 64 bits of 16 cycles and three gaps of 180 at 60 MHz. */
    assert_int_equal(whisker_settings_latency_ns(&settings), 500000 + (64 * 16 + 3 * 180) * 50 / 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(an_hour_of_drift_and_jitter_stays_within_100_us, begin),
        cmocka_unit_test_setup(a_mapping_goes_both_ways_in_time_and_to_both_clocks, begin),
        cmocka_unit_test_setup(start_of_frame_numbers_date_whatever_ticks, begin),
        cmocka_unit_test_setup(without_reports_a_date_is_known_to_a_microframe, begin),
        cmocka_unit_test_setup(a_bus_that_falls_silent_begins_a_new_fit, begin),
        cmocka_unit_test_setup(a_bus_whose_time_stood_still_begins_a_new_fit, begin),
        cmocka_unit_test_setup(a_bridge_that_starts_again_begins_a_new_fit, begin),
        cmocka_unit_test_setup(a_monotonic_clock_that_goes_back_is_reported_and_survived, begin),
        cmocka_unit_test_setup(a_realtime_clock_that_is_set_is_reported_and_followed, begin),
        cmocka_unit_test_setup(clocks_that_jump_apart_begin_a_new_fit, begin),
        cmocka_unit_test_setup(a_long_stall_moves_nothing, begin),
        cmocka_unit_test_setup(the_line_lies_closest_below_all_points, begin),
        cmocka_unit_test_setup(a_clock_of_another_rate_is_never_claimed_to_be_known, begin),
        cmocka_unit_test(the_least_latency_follows_from_the_settings),
    };
    return cmocka_run_group_tests_name("clock", tests, NULL, NULL);
}
