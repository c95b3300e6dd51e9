#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdlib.h>

#include "robot.h"
#include "texture_whisker.h"

#define STEP_M 0.05e-3 /* a tick at 0.1 m/s */
#define FIELD_DEG_PER_MM (SIM_FIELD_GAIN * SIM_TIP_TILT_DEG_PER_MM)

static struct sim_texture_whisker start(uint64_t seed)
{
    struct sim_whisker mount = texture_whisker("left_floor", -0.02, 0.21);
    struct sim_texture_whisker whisker;
    sim_texture_whisker_start(&whisker, &mount, (struct sim_pose){0, 0, 0}, sim_rng_stream(seed, 3, 0));
    return whisker;
}

/* Drags the tip straight by one step, n counted from the start. */
static void drag(struct sim_texture_whisker *whisker, const char *floor, double x)
{
    sim_texture_whisker_move(whisker, sim_floor_texture(floor), (struct sim_pose){x, 0, 0});
}

static const char *const FLOORS[] = {"VINYL", "SMOOTH", "ROUGH"};

/* Variances of roughness and weave add up on the beta axis: rms^2 + A^2/2. */
static void test_rms_of_each_floor(void **state)
{
    (void)state;
    enum { N = 800000 };
    for (int f = 0; f < 3; f++) {
        const struct sim_floor_texture *floor = sim_floor_texture(FLOORS[f]);
        struct sim_texture_whisker whisker = start(1);
        double square = 0;
        for (int n = 1; n <= N; n++) {
            drag(&whisker, FLOORS[f], n * STEP_M);
            double beta = sim_texture_whisker_field(&whisker, floor).beta_deg;
            square += beta * beta / N;
        }
        double amplitude = floor->weave_amplitude_mm;
        double wanted = FIELD_DEG_PER_MM * sqrt(floor->rms_mm * floor->rms_mm + amplitude * amplitude / 2);
        assert_near(sqrt(square), wanted, 0.04 * wanted);
    }
}

static void test_correlation_length_of_each_floor(void **state)
{
    (void)state;
    enum { N = 800000 };
    double *roughness = malloc(N * sizeof *roughness);
    assert_non_null(roughness);
    for (int f = 0; f < 3; f++) {
        struct sim_texture_whisker whisker = start(2);
        for (int n = 0; n < N; n++) {
            drag(&whisker, FLOORS[f], (n + 1) * STEP_M);
            roughness[n] = whisker.roughness;
        }
        int lag = (int)lround(sim_floor_texture(FLOORS[f])->correlation_mm * 1e-3 / STEP_M);
        double product = 0, square = 0;
        for (int n = 0; n + lag < N; n++) {
            product += roughness[n] * roughness[n + lag];
            square += roughness[n] * roughness[n];
        }
        assert_near(product / square, exp(-1), 0.03);
    }
    free(roughness);
}

/* One slip every J of travel, each dropping the deflection by J on average. */
static void test_slips_repeat_every_jump(void **state)
{
    (void)state;
    enum { N = 400000 };
    for (int f = 0; f < 3; f++) {
        double jump = sim_texture_whisker_slip_mm(sim_floor_texture(FLOORS[f])), before = 0, dropped = 0;
        struct sim_texture_whisker whisker = start(3);
        int slips = 0;
        for (int n = 1; n <= N; n++) {
            drag(&whisker, FLOORS[f], n * STEP_M);
            double now = -whisker.stuck_mm;
            assert_true(now > -1e-9 && now < 1.6 * jump);
            if (now < before) {
                slips++;
                dropped += before - now;
            }
            before = now;
        }
        assert_near(N * STEP_M * 1e3 / slips, jump, 0.02 * jump);
        assert_near(dropped / slips, jump, 0.12 * jump);
    }
}

/* Periods of the weave are its wavelength on average and differ by 10 %. */
static void test_weave_period_and_jitter(void **state)
{
    (void)state;
    struct sim_texture_whisker whisker = start(4);
    double wavelength = sim_floor_texture("ROUGH")->weave_wavelength_mm * 1e-3, last = 0, sum = 0, square = 0;
    int periods = -1; /* the first is cut by the start */
    for (int n = 1; periods < 2000; n++) {
        double phase = whisker.weave_phase;
        drag(&whisker, "ROUGH", n * STEP_M);
        if (whisker.weave_phase > phase)
            continue;
        double length = (n * STEP_M - last) / wavelength;
        last = n * STEP_M;
        if (periods++ < 0)
            continue;
        sum += length;
        square += length * length;
    }
    double mean = sum / periods;
    assert_near(mean, 1, 0.01);
    assert_near(sqrt(square / periods - mean * mean), 0.1, 0.01);
}

static void test_the_floor_pulls_against_the_motion(void **state)
{
    (void)state;
    const struct sim_floor_texture *floor = sim_floor_texture("ROUGH");
    struct sim_texture_whisker whisker = start(5);
    drag(&whisker, "ROUGH", 0.5e-3);
    assert_near(sim_texture_whisker_field(&whisker, floor).alpha_deg, -0.5 * FIELD_DEG_PER_MM, 1e-9);
    drag(&whisker, "ROUGH", -0.2e-3);
    assert_near(sim_texture_whisker_field(&whisker, floor).alpha_deg, 0.2 * FIELD_DEG_PER_MM, 1e-9);
}

static void test_nothing_changes_at_rest(void **state)
{
    (void)state;
    const struct sim_floor_texture *floor = sim_floor_texture("SMOOTH");
    struct sim_texture_whisker whisker = start(6);
    drag(&whisker, "SMOOTH", 0.01);
    struct sim_field before = sim_texture_whisker_field(&whisker, floor);
    for (int n = 0; n < 100; n++)
        drag(&whisker, "SMOOTH", 0.01);
    assert_near(sim_texture_whisker_field(&whisker, floor).alpha_deg, before.alpha_deg, 0);
    assert_near(sim_texture_whisker_field(&whisker, floor).beta_deg, before.beta_deg, 0);
}

/* What is travelled is the path of the tip, not of the robot: turning on the spot drags it too. */
static void test_travel_is_the_tips(void **state)
{
    (void)state;
    struct sim_texture_whisker whisker = start(7);
    for (int n = 1; n <= 1000; n++)
        sim_texture_whisker_move(&whisker, sim_floor_texture("VINYL"), (struct sim_pose){0, 0, n * 1e-3});
    assert_near(whisker.travelled_m, hypot(0.02, 0.21), 1e-6);
}

static void test_unknown_floor(void **state)
{
    (void)state;
    assert_null(sim_floor_texture("GRASS"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rms_of_each_floor),
        cmocka_unit_test(test_correlation_length_of_each_floor),
        cmocka_unit_test(test_slips_repeat_every_jump),
        cmocka_unit_test(test_weave_period_and_jitter),
        cmocka_unit_test(test_the_floor_pulls_against_the_motion),
        cmocka_unit_test(test_nothing_changes_at_rest),
        cmocka_unit_test(test_travel_is_the_tips),
        cmocka_unit_test(test_unknown_floor),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
