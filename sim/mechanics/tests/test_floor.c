#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "mech_drag.h"
#include "near.h"

#define VINYL (&SIM_FLOOR_TEXTURES[0])
#define SMOOTH (&SIM_FLOOR_TEXTURES[1])
#define ROUGH (&SIM_FLOOR_TEXTURES[2])

static const struct sim_floor_texture FLAT = {"FLAT", 0, 1, 0, 0, 0.15, false};
static const struct sim_floor_texture PILE = {"PILE", 0.055, 5, 0, 0, 0.05, true}; /* vinyl whose edges hook */

/* Whisker physics, section 7: the classes' ranges, and that the profile is what the floor says. */
static void test_profile(void **state)
{
    (void)state;
    const double low[] = {0.03, 0.2, 0.6}, high[] = {0.08, 0.4, 1.2};
    for (int f = 0; f < SIM_FLOOR_TEXTURE_COUNT; f++) {
        struct sim_floor_texture floor = SIM_FLOOR_TEXTURES[f];
        assert_true(floor.rms_mm >= low[f] && floor.rms_mm <= high[f]);
        floor.weave_amplitude_mm = 0;
        enum { N = 400000, LAG = 8 };
        const double step = 0.25e-3;
        static double z[N];
        struct mech_floor profile;
        double square = 0, product = 0;
        mech_floor_start(&profile, &floor, sim_rng_stream(1, 2, (uint32_t)f));
        for (int i = 0; i < N; i++) {
            mech_floor_move(&profile, &floor, step);
            z[i] = 1e3 * mech_floor_height(&profile, &floor);
            square += z[i] * z[i] / N;
            product += i >= LAG ? z[i] * z[i - LAG] / N : 0;
        }
        assert_share(sqrt(square), floor.rms_mm, 0.05);
        assert_near(product / square, exp(-1e3 * step * LAG / floor.correlation_mm), 0.04);
    }
}

/* Power of the profile about a spatial frequency (cycles/m), by correlation with many windows of 50 mm. */
static double power_at(const struct sim_floor_texture *floor, double cycles)
{
    enum { WINDOWS = 400, N = 1000 };
    const double step = 50e-6;
    struct mech_floor profile;
    double sum = 0;
    mech_floor_start(&profile, floor, sim_rng_stream(9, 9, 9));
    for (int w = 0; w < WINDOWS; w++) {
        double re = 0, im = 0;
        for (int i = 0; i < N; i++) {
            mech_floor_move(&profile, floor, step);
            double z = mech_floor_height(&profile, floor), taper = 1 - cos(2 * SIM_PI * i / N);
            re += taper * z * cos(2 * SIM_PI * cycles * step * i);
            im += taper * z * sin(2 * SIM_PI * cycles * step * i);
        }
        sum += re * re + im * im;
    }
    return sum;
}

/* Falls as the square of the frequency, ends at 2000 cycles/m, and a weave stands out at its wavelength. */
static void test_spectrum(void **state)
{
    (void)state;
    struct sim_floor_texture plain = *SMOOTH;
    plain.weave_amplitude_mm = 0;
    double slope = log(power_at(&plain, 300) / power_at(&plain, 1200)) / log(4);
    assert_near(slope, 2, 0.35);
    assert_true(power_at(&plain, 3000) < 0.05 * power_at(&plain, 1200));
    assert_true(power_at(SMOOTH, 1000.0 / 3) > 2 * power_at(&plain, 1000.0 / 3));
}

static void start_at(int level, struct mech_drag *drag, const struct mech_stance *stance,
                     const struct sim_floor_texture *floor, uint32_t seed)
{
    struct mech_whisker w = mech_whisker_default();
    mech_drag_start(drag, &w, stance, floor, sim_rng_stream(seed, 1, 0), level, TICK);
}

static void start(struct mech_drag *drag, const struct mech_stance *stance, const struct sim_floor_texture *floor,
                  uint32_t seed)
{
    start_at(MECH_VIBRATION, drag, stance, floor, seed);
}

static void advance(struct mech_drag *drag, const struct sim_floor_texture *floor, double speed, double height)
{
    struct mech_stroke stroke = {speed * TICK, height, 0};
    mech_drag_step(drag, floor, &stroke);
}

/* The table's tilt per tip displacement, across the path: a slow sweep follows the floor one to one. */
static void test_static_transfer(void **state)
{
    (void)state;
    struct mech_stance stance = mech_stance_default();
    struct mech_drag drag;
    start(&drag, &stance, SMOOTH, 1);
    for (int i = 0; i < 40000; i++) {
        advance(&drag, SMOOTH, 2e-4, 0);
        double z_mm = 1e3 * mech_floor_height(&drag.profile, SMOOTH);
        assert_near(drag.tilt[1] / SIM_DEGREE, 0.0940 * z_mm, 0.003);
    }
}

/* Slip of J = 2 (mu_s - mu_k) N/k at a rate of v/J: the level without vibration. N = 0.35 mN, 0.15: 1.52 mm, 66 Hz at
 * 0.1 m/s, 0.143 degrees; 0.05: 0.51 mm, 197 Hz. */
static void test_stick_slip_table(void **state)
{
    (void)state;
    const struct {
        double drop, hertz, tilt_deg;
    } list[] = {{0.15, 66, 0.143}, {0.05, 197, 0.143 / 3}};
    for (size_t k = 0; k < COUNT(list); k++) {
        struct sim_floor_texture floor = FLAT;
        struct mech_stance stance = mech_stance_default();
        struct mech_drag drag;
        double low = 1, high = -1;
        floor.friction_drop = list[k].drop;
        stance.preload = 0.35e-3 / 0.0691;
        start_at(MECH_CLOSED, &drag, &stance, &floor, 1);
        long before = 0;
        for (int i = 0; i < 42000; i++) {
            advance(&drag, &floor, 0.1, 0);
            before = i == 2000 ? drag.slips : before;
            if (i > 2000) {
                low = fmin(low, drag.tilt[0]);
                high = fmax(high, drag.tilt[0]);
            }
        }
        assert_share((double)(drag.slips - before) / 20, list[k].hertz, 0.06); /* slips wait for a tick's end */
        assert_near((high - low) / SIM_DEGREE, list[k].tilt_deg, 0.006);
    }
}

/* With vibration a slip is an event of the whisker: slow tips stick and slip, fast ones slide, and neither pulls harder
 * than static friction. */
static void test_stick_slip_with_vibration(void **state)
{
    (void)state;
    struct mech_stance stance = mech_stance_default();
    long slips[2];
    for (int k = 0; k < 2; k++) {
        struct mech_drag drag;
        start(&drag, &stance, &FLAT, 1);
        for (int i = 0; i < 40000; i++) {
            advance(&drag, &FLAT, k ? 0.4 : 0.01, 0);
            double normal = drag.axes.pinned.answer_static * stance.preload;
            if (drag.contact == MECH_STICKS)
                assert_true(fabs(mech_basis_answer(&drag.axes.pinned, &drag.axes.motion[0])) <=
                            (drag.whisker.friction + FLAT.friction_drop) * normal * 1.01);
        }
        slips[k] = drag.slips;
        if (k) /* sliding: kinetic friction, against the travel */
            assert_share(drag.moment[0], -drag.whisker.friction * stance.preload * drag.axes.pinned.moment_static,
                         0.02);
    }
    assert_true(slips[0] > 20);
    assert_true(slips[1] < 5);
}

/* Rough floor taken fast: the tip leaves it now and then, and what it does stays within what the floor can do. */
static void test_lift_off(void **state)
{
    (void)state;
    struct mech_stance stance = mech_stance_default();
    const double speed[] = {0.02, 0.2};
    double share[2];
    for (int k = 0; k < 2; k++) {
        struct mech_drag drag;
        int lifted = 0;
        start(&drag, &stance, ROUGH, 3);
        for (int i = 0; i < 40000; i++) {
            advance(&drag, ROUGH, speed[k], 0);
            lifted += drag.lifted;
            assert_true(fabs(drag.tilt[0]) < 2 * SIM_DEGREE && fabs(drag.tilt[1]) < 2 * SIM_DEGREE);
        }
        share[k] = lifted / 40000.0;
    }
    assert_true(share[0] < 0.01 && share[1] > 0.1 && share[1] < 0.8);
}

/* Time that the edge of a pile holds the tip: height of the mount, speed, and where it is hooked. Either level. */
static void test_hook_table(void **state)
{
    (void)state;
    const struct {
        double height_mm, reach_mm, held_s[3];
    } table[] = {{60, 126.5, {2.5, 1.26, 0.63}}, {80, 114.9, {2.3, 1.15, 0.57}}, {100, 98.0, {2.0, 0.98, 0.49}}};
    const double speed[] = {0.05, 0.1, 0.2};
    for (size_t i = 0; i < COUNT(table); i++) {
        for (int v = 0; v < 3; v++) {
            for (int level = MECH_CLOSED; level <= MECH_VIBRATION; level += MECH_VIBRATION) {
                struct mech_stance stance = mech_stance_default();
                struct mech_drag drag;
                int held = 0;
                stance.height = table[i].height_mm * 1e-3;
                stance.behind = 0;
                start_at(level, &drag, &stance, &PILE, 5);
                assert_near(1e3 * mech_drag_reach(&drag.whisker, &stance), table[i].reach_mm, 0.06);
                for (int k = 0; k < 7000; k++) {
                    advance(&drag, &PILE, speed[v], k > 300 ? 1e-3 : 0);
                    held += drag.contact == MECH_HOOKED;
                    assert_true(fabs(drag.tilt[0]) <= drag.whisker.stop);
                }
                assert_int_equal(drag.catches, 1);
                /* The tip already trails by what friction holds, up to 2.3 mm; the table is rounded by up to 2 %. */
                assert_near(held * TICK, table[i].held_s[v], 2.3e-3 / speed[v] + 0.021 * table[i].held_s[v]);
            }
        }
    }
}

/* Let go by a pile the whisker springs forward: the tilt, backwards until then, swings to the other side. */
static void test_release_springs_forward(void **state)
{
    (void)state;
    struct mech_stance stance = mech_stance_default();
    struct mech_drag drag;
    double most = 0, before = 0;
    int was = 0;
    start(&drag, &stance, &PILE, 5);
    for (int k = 0; k < 4000; k++) {
        advance(&drag, &PILE, 0.1, k > 300 ? 1e-3 : 0);
        if (drag.contact == MECH_HOOKED)
            before = drag.tilt[0];
        was |= drag.contact == MECH_HOOKED;
        if (was && drag.contact != MECH_HOOKED)
            most = fmax(most, drag.tilt[0]);
    }
    assert_true(before < -SIM_DEGREE);
    assert_true(most > -0.3 * before);
    assert_near(drag.height, 1e-3, 1e-12);
    assert_true(drag.contact != MECH_HOOKED);
}

/* Drags a whisker of this stance over a step that comes after 15 mm, and back again from 2 mm behind it on if it turns.
 * Returns for how long the step holds it, s. */
static double held_at(int level, struct mech_drag *drag, const struct mech_stance *stance,
                      const struct sim_floor_texture *floor, double step, bool turns)
{
    const double speed = 0.1;
    int held = 0;
    start_at(level, drag, stance, floor, 5);
    for (int k = 1; k < 3000; k++) {
        bool back = turns && k > 340;
        double at = speed * TICK * (back ? 680 - k : k);
        advance(drag, floor, back ? -speed : speed, at > 15e-3 ? step : 0);
        held += drag->contact == MECH_HOOKED || drag->contact == MECH_EDGE;
    }
    return held * TICK;
}

static double held_by(struct mech_drag *drag, const struct mech_stance *stance, const struct sim_floor_texture *floor,
                      double step, bool turns)
{
    return held_at(MECH_VIBRATION, drag, stance, floor, step, turns);
}

/* What a pile does not hold: a whisker tilted backwards, a step down, one lower than the tip's radius, a way back. */
static void test_hooks_that_are_not(void **state)
{
    (void)state;
    struct mech_stance stance = mech_stance_default(), tilted = stance;
    struct mech_drag drag;
    tilted.behind = 0.112;
    assert_true(held_by(&drag, &stance, &PILE, 1e-3, false) > 0.5);
    assert_true(held_by(&drag, &tilted, &PILE, 1e-3, false) < 0.04);
    assert_true(held_by(&drag, &stance, &PILE, -1e-3, false) == 0);
    assert_true(held_by(&drag, &stance, &PILE, 0.14e-3, false) < 0.04);
    for (int level = MECH_CLOSED; level <= MECH_VIBRATION; level += MECH_VIBRATION) {
        assert_true(held_at(level, &drag, &stance, &PILE, 1e-3, true) < 0.045);
        assert_int_equal(drag.catches, 1);
        assert_true(drag.contact < MECH_HOOKED);
    }
}

/* A step without a pile: the higher, the longer it holds; the round of the tip rolls over a very low one; a step down
 * and a step met backwards hold nothing; a robot that backs off is free. Either level, and the tip ends on top. */
static void test_steps(void **state)
{
    (void)state;
    struct mech_stance stance = mech_stance_default();
    struct mech_drag drag;
    const double step[] = {-3e-3, 0.05e-3, 0.15e-3, 0.3e-3, 1e-3, 3e-3, 10e-3};
    double before = 0;
    for (size_t i = 0; i < COUNT(step); i++) {
        double held = held_by(&drag, &stance, &FLAT, step[i], false);
        assert_int_equal(held > 0, i > 1);
        assert_true(held > before || i < 2);
        before = held;
        assert_near(drag.height, step[i], 0);
        assert_true(fabs(drag.tilt[0]) < SIM_DEGREE);
    }
    assert_true(before < 0.3);
    assert_true(held_by(&drag, &stance, &FLAT, 3e-3, true) < 0.045);
    assert_near(drag.height, 0, 0);
    assert_true(drag.contact != MECH_EDGE);
}

/* A mount that stands while the tip is at a corner: it stays there, and what rings fades. */
static void test_standing_at_a_step(void **state)
{
    (void)state;
    struct mech_stance stance = mech_stance_default();
    struct mech_drag drag;
    start(&drag, &stance, &FLAT, 5);
    for (int k = 0; k < 420; k++)
        advance(&drag, &FLAT, 0.1, k > 300 ? 3e-3 : 0);
    for (int k = 0; k < 4000; k++)
        advance(&drag, &FLAT, 0, 3e-3);
    double tilt = drag.tilt[0];
    assert_int_equal(drag.contact, MECH_EDGE);
    assert_true(tilt < -0.2 * SIM_DEGREE);
    advance(&drag, &FLAT, 0, 3e-3);
    assert_near(drag.tilt[0], tilt, 1e-6 * SIM_DEGREE);
}

/* A robot that stands: what rings fades, then nothing is done, and what comes out stays. */
static void test_standing_is_rest(void **state)
{
    (void)state;
    struct mech_stance stance = mech_stance_default();
    struct mech_drag drag, before;
    start(&drag, &stance, ROUGH, 7);
    for (int i = 0; i < 2000; i++)
        advance(&drag, ROUGH, 0.1, 0);
    for (int i = 0; i < 4000; i++)
        advance(&drag, ROUGH, 0, 0);
    assert_true(drag.resting);
    before = drag;
    advance(&drag, ROUGH, 0, 0);
    assert_memory_equal(&drag, &before, sizeof drag);
    double tilt = drag.tilt[1];
    advance(&drag, ROUGH, 1e-4, 0);
    assert_near(drag.tilt[1], tilt, 1e-4 * SIM_DEGREE + 2 * MECH_FADED * mech_whisker_compliance(&drag.whisker));
}

/* Garbage in: nothing that is not finite comes out. */
static void test_garbage(void **state)
{
    (void)state;
    const double bad[] = {NAN, INFINITY, 1e300, -1e300, 1e-300, 0.1};
    struct mech_stance stance = mech_stance_default();
    struct sim_rng rng = sim_rng_stream(5, 5, 5);
    struct mech_drag drag;
    start(&drag, &stance, ROUGH, 7);
    for (int i = 0; i < 20000; i++) {
        struct mech_stroke stroke = {bad[sim_rng_next(&rng) % 6], bad[sim_rng_next(&rng) % 6],
                                     bad[sim_rng_next(&rng) % 6]};
        if (i % 3)
            stroke = (struct mech_stroke){5e-5, 0, 0};
        mech_drag_step(&drag, ROUGH, &stroke);
        assert_true(isfinite(drag.tilt[0]) && isfinite(drag.tilt[1]));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_profile),
        cmocka_unit_test(test_spectrum),
        cmocka_unit_test(test_static_transfer),
        cmocka_unit_test(test_stick_slip_table),
        cmocka_unit_test(test_stick_slip_with_vibration),
        cmocka_unit_test(test_lift_off),
        cmocka_unit_test(test_hook_table),
        cmocka_unit_test(test_release_springs_forward),
        cmocka_unit_test(test_hooks_that_are_not),
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_standing_at_a_step),
        cmocka_unit_test(test_standing_is_rest),
        cmocka_unit_test(test_garbage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
