#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base.h"
#include "robot.h"

static void test_drives_along_arcs(void **state)
{
    (void)state;
    struct sim_base base = {0, 0};
    struct sim_pose pose = {1, 1, 0};
    sim_base_drive(&base, 0.1, 0.1 * SIM_PI); /* radius 1/pi, half a circle in 10 s */
    for (int i = 0; i < 20000; i++)
        pose = sim_base_advance(&base, pose, SIM_TICK_S);
    assert_near(pose.x, 1, 1e-9);
    assert_near(pose.y, 1 + 2 / SIM_PI, 1e-9);
    assert_near(fabs(pose.theta), SIM_PI, 1e-9);
}

static void test_wheels_have_a_limit(void **state)
{
    (void)state;
    struct sim_base base = {0, 0};
    sim_base_drive(&base, 3, 0);
    assert_near(base.v, SIM_BASE_WHEEL_LIMIT, 1e-12);
    sim_base_drive(&base, -0.4, 2);
    assert_near(fabs(base.v) + base.omega * SIM_BASE_TRACK / 2, SIM_BASE_WHEEL_LIMIT, 1e-12);
    assert_near(base.omega / base.v, -5, 1e-12); /* the same curve */
}

static void test_same_command_is_the_same_move(void **state)
{
    (void)state;
    struct sim_base base = {0, 0};
    assert_int_equal(sim_base_drive(&base, 0.1, 0), 1);
    assert_int_equal(sim_base_drive(&base, 0.1, 0), 0);
    assert_int_equal(sim_base_drive(&base, 0.1, 0.1), 1);
}

/* A body whisk turns 0.75 degrees per report: lost remainders would report no turn at all. */
static void test_reports_are_whole_and_lose_nothing(void **state)
{
    (void)state;
    struct sim_odometer odometer;
    sim_odometer_start(&odometer, sim_rng_stream(1, 1, 0));
    double gain = odometer.scale_angle * odometer.gain_angle, turned = 0, sum = 0;
    for (int i = 0; i < 300; i++) {
        double step = (i < 200 ? 1 : -1) * 0.1 * SIM_PI / 24;
        sim_odometer_count(&odometer, 0, step);
        double degrees = sim_odometer_report(&odometer).theta / SIM_DEGREE;
        assert_near(degrees, round(degrees), 1e-9);
        turned += step / SIM_DEGREE * gain;
        sum += degrees;
        assert_near(sum, turned, 1 + 1e-9);
    }
    assert_true(sum > 60);
}

static void test_distance_remainder_is_kept(void **state)
{
    (void)state;
    struct sim_odometer odometer;
    sim_odometer_start(&odometer, sim_rng_stream(2, 1, 0));
    double gain = odometer.scale_distance * odometer.gain_distance, sum = 0;
    for (int i = 0; i < 1000; i++) {
        sim_odometer_count(&odometer, -0.4e-3, 0);
        struct sim_pose report = sim_odometer_report(&odometer);
        assert_near(report.x * 1e3, round(report.x * 1e3), 1e-9);
        sum += report.x;
    }
    assert_near(sum, -0.4 * gain, 1e-3 + 1e-9);
}

static void test_report_is_the_end_of_an_arc(void **state)
{
    (void)state;
    struct sim_odometer odometer = {.scale_distance = 1,
                                    .scale_angle = 1,
                                    .gain_distance = 1,
                                    .gain_angle = 1,
                                    .distance_mm = 100,
                                    .angle_deg = 90};
    struct sim_pose report = sim_odometer_report(&odometer);
    double radius = 0.1 / (SIM_PI / 2);
    assert_near(report.x, radius, 1e-12);
    assert_near(report.y, radius, 1e-12);
}

/* Errors of runs N(0, 0.01), of moves N(0, 0.02) clipped to 0.05. */
static void test_error_spreads(void **state)
{
    (void)state;
    enum { RUNS = 4000 };
    double run = 0, move = 0, cross = 0, largest = 0;
    for (uint32_t i = 0; i < RUNS; i++) {
        struct sim_odometer odometer;
        sim_odometer_start(&odometer, sim_rng_stream(3, 1, i));
        double a = odometer.scale_distance - 1, b = odometer.gain_angle - 1;
        run += a * a / RUNS;
        move += b * b / RUNS;
        cross += (odometer.scale_angle - 1) * a / RUNS;
        largest = fmax(largest, fabs(b));
    }
    assert_near(sqrt(run), 0.01, 0.0005);
    assert_near(sqrt(move), 0.02, 0.001);
    assert_near(cross, 0, 0.00001);
    assert_near(largest, 0.05, 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_drives_along_arcs),
        cmocka_unit_test(test_wheels_have_a_limit),
        cmocka_unit_test(test_same_command_is_the_same_move),
        cmocka_unit_test(test_reports_are_whole_and_lose_nothing),
        cmocka_unit_test(test_distance_remainder_is_kept),
        cmocka_unit_test(test_report_is_the_end_of_an_arc),
        cmocka_unit_test(test_error_spreads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
