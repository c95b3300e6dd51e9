#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "mech_shaft.h"
#include "near.h"
#include "one_table.h"
#include "sim_rng.h"

static struct mech_whisker plain(double damping)
{
    struct mech_whisker w = mech_whisker_default();
    w.damping = damping;
    w.creep = 0;
    w.friction = 0;
    return w;
}

/* A whisk to an angle at a rate, then held; the largest moment. */
static double whisk_peak(const struct mech_whisker *w, double a, double rate, double angle, int level)
{
    struct mech_shaft shaft;
    double peak = 0;
    mech_shaft_start(&shaft, w, table, level, TICK);
    for (int i = 1; i * TICK < angle / rate + 0.3; i++) {
        struct mech_touch touch = {true, a, fmin(angle, rate * i * TICK), 0, false};
        mech_shaft_step(&shaft, &touch);
        peak = fmax(peak, shaft.moment);
    }
    return peak;
}

/* Whisker physics, section 5: overshoot of a whisk to 5 degrees. Its damping is not stated, so the slow whisks are held
 * to it within a third and the fast ones within what damping ratios 0.05 to 0.15 span. */
static void test_overshoot_table(void **state)
{
    (void)state;
    const double angle = 5 * SIM_DEGREE, slow = SIM_PI / 24;
    const struct {
        double a, rate, percent;
    } list[] = {{0.090, slow, 0.5},     {0.110, slow, 0.7},      {0.135, slow, 1.4},
                {0.110, SIM_PI / 6, 3}, {0.110, SIM_PI / 2, 12}, {0.110, 2 * SIM_PI, 46}};
    for (size_t i = 0; i < COUNT(list); i++) {
        double over[2];
        for (int k = 0; k < 2; k++) {
            struct mech_whisker w = plain(k ? 0.05 : 0.15);
            double peak = whisk_peak(&w, list[i].a, list[i].rate, angle, MECH_CLOSED | MECH_VIBRATION);
            over[k] = 100 * (peak / mech_whisker_moment(&w, list[i].a, angle) - 1);
        }
        assert_true(over[0] < 1.33 * list[i].percent && over[1] > 0.67 * list[i].percent);
    }
}

/* A whisker that bounces on its edge gains nothing by it: with the lowest damping assumed it stays near the static law,
 * wherever along the shaft the edge lies. */
static void test_bouncing_does_not_build_up(void **state)
{
    (void)state;
    const double angle = 5 * SIM_DEGREE, rate = SIM_PI / 24;
    for (double a = 0.09; a < 0.139; a += 0.002) {
        struct mech_whisker w = plain(0.05);
        struct mech_shaft shaft;
        double largest = mech_whisker_moment(&w, a, angle);
        w.kappa = 1.17;
        mech_shaft_start(&shaft, &w, table, MECH_CLOSED | MECH_VIBRATION, TICK);
        for (int i = 1; rate * i * TICK < angle; i++) {
            struct mech_touch touch = {true, a, rate * i * TICK, 0, false};
            mech_shaft_step(&shaft, &touch);
            assert_near(shaft.moment, mech_whisker_moment(&w, a, touch.theta), 0.1 * largest);
        }
    }
}

/* Rest costs and does nothing; a touch ends it; after it everything comes back to rest exactly. */
static void test_rest(void **state)
{
    (void)state;
    struct mech_whisker w = mech_whisker_default();
    struct mech_shaft shaft, before;
    struct mech_touch none = {false, 0, 0, 0, false}, push = {true, 0.11, 0.05, 0, false};
    mech_shaft_start(&shaft, &w, table, MECH_LARGE | MECH_VIBRATION, TICK);
    before = shaft;
    mech_shaft_step(&shaft, &none);
    assert_memory_equal(&shaft, &before, sizeof shaft);
    for (int i = 0; i < 400; i++)
        mech_shaft_step(&shaft, &push);
    assert_true(shaft.tilt > 0 && !shaft.resting);
    for (int i = 0; i < 40000; i++)
        mech_shaft_step(&shaft, &none);
    assert_true(shaft.resting);
    assert_true(shaft.tilt == 0 && shaft.moment == 0);
}

/* Each level is the whole of them within what it leaves out: the law, which friction and bending change by some
 * percent, and the swing. */
static void test_levels_agree(void **state)
{
    (void)state;
    struct mech_whisker w = plain(0.1);
    const double angle = 5 * SIM_DEGREE, slow = 0.005;
    double whole = whisk_peak(&w, 0.1, slow, angle, MECH_LARGE | MECH_VIBRATION);
    assert_share(whisk_peak(&w, 0.1, slow, angle, MECH_LARGE), whole, 1e-3);
    assert_share(whisk_peak(&w, 0.1, slow, angle, MECH_CLOSED), mech_whisker_moment(&w, 0.1, angle), 1e-9);
    double error = whisk_peak(&w, 0.1, slow, angle, MECH_CLOSED) / whole - 1;
    assert_true(error > 1e-4 && error < 0.02);
}

/* Slips off near the table's angle, and does not touch again before it is clear. */
static void test_slips_off_once(void **state)
{
    (void)state;
    struct mech_whisker w = plain(0.1);
    struct mech_shaft shaft;
    int off = 0;
    mech_shaft_start(&shaft, &w, table, MECH_LARGE | MECH_VIBRATION, TICK);
    for (int i = 1; i < 8000; i++) {
        struct mech_touch touch = {true, 0.13, 1e-4 * i, 0, false};
        mech_shaft_step(&shaft, &touch);
        if (!off && shaft.slipped)
            off = i;
    }
    assert_near(1e-4 * off / SIM_DEGREE, 24.8, 0.36);
    assert_true(!shaft.engaged && shaft.tilt == 0);
    struct mech_touch clear = {false, 0, 0, 0, false};
    mech_shaft_step(&shaft, &clear);
    for (int i = 1; i < 400; i++) {
        struct mech_touch again = {true, 0.13, 1e-4 * i, 0, false};
        mech_shaft_step(&shaft, &again);
    }
    assert_true(shaft.engaged && shaft.tilt > 0);
}

/* Creep: the plug tilts on by its share under a constant force, and the imposed angle stays what it is. */
static void test_creep(void **state)
{
    (void)state;
    struct mech_whisker w = plain(0.1);
    struct mech_shaft shaft;
    double soon = 0;
    w.creep = 0.10;
    mech_shaft_start(&shaft, &w, table, MECH_CLOSED, TICK);
    for (int i = 0; i < 10000; i++) {
        struct mech_touch touch = {true, 0.11, 0.05, 0, false};
        mech_shaft_step(&shaft, &touch);
        if (i == 0)
            soon = shaft.tilt;
    }
    /* As a plug that is softer by the creep: kappa/1.1. */
    assert_share(soon, mech_whisker_tilt(&w, 0.11, 0.05), 1e-3);
    w.kappa /= 1.1;
    assert_share(shaft.tilt, mech_whisker_tilt(&w, 0.11, 0.05), 1e-3);
}

/* A mount that starts to turn makes a free whisker ring at its own frequency and at nothing else. */
static void test_base_motion(void **state)
{
    (void)state;
    struct mech_whisker w = plain(0.05);
    struct mech_shaft shaft;
    double last = 0, first = 0, largest = 0;
    int rises = 0, latest = 0;
    mech_shaft_start(&shaft, &w, table, MECH_LARGE | MECH_VIBRATION, TICK);
    for (int i = 0; i < 800; i++) {
        struct mech_touch touch = {false, 0, 0, 0.5, false};
        mech_shaft_step(&shaft, &touch);
        largest = fmax(largest, fabs(shaft.tilt));
        if (last < 0 && shaft.tilt >= 0 && rises++ == 0)
            first = i;
        if (last < 0 && shaft.tilt >= 0)
            latest = i;
        last = shaft.tilt;
    }
    assert_share((rises - 1) / ((latest - first) * TICK), 16.34, 0.02);
    assert_in_range((int)(1e6 * largest), 1000, 10000); /* rad/s over 2 pi 16 Hz is 5 mrad of whisker */
}

/* Garbage in: nothing that is not finite comes out. */
static void test_garbage(void **state)
{
    (void)state;
    const double bad[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 0, 0.1, -3, 1e-300};
    struct sim_rng rng = sim_rng_stream(5, 5, 5);
    struct mech_whisker w = mech_whisker_default();
    struct mech_shaft shaft;
    mech_shaft_start(&shaft, &w, table, MECH_LARGE | MECH_VIBRATION, TICK);
    for (int i = 0; i < 20000; i++) {
        double value[3];
        for (int k = 0; k < 3; k++)
            value[k] =
                sim_rng_next(&rng) % 4 == 0 ? bad[sim_rng_next(&rng) % COUNT(bad)] : 0.14 * sim_rng_uniform(&rng);
        struct mech_touch touch = {sim_rng_next(&rng) % 8 != 0, value[0], value[1], value[2], false};
        mech_shaft_step(&shaft, &touch);
        assert_true(isfinite(shaft.tilt) && isfinite(shaft.moment));
        assert_true(fabs(shaft.tilt) <= 1.2 * w.stop);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_overshoot_table),
        cmocka_unit_test(test_bouncing_does_not_build_up),
        cmocka_unit_test(test_rest),
        cmocka_unit_test(test_levels_agree),
        cmocka_unit_test(test_slips_off_once),
        cmocka_unit_test(test_creep),
        cmocka_unit_test(test_base_motion),
        cmocka_unit_test(test_garbage),
    };
    return cmocka_run_group_tests(tests, make_table, drop_table);
}
