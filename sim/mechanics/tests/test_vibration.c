#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "mech_vibration.h"
#include "near.h"

static struct mech_whisker with(double kappa, double young, double damping)
{
    struct mech_whisker w = mech_whisker_default();
    w.kappa = kappa;
    w.young = young;
    w.damping = damping;
    return w;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Sorted frequencies, Hz; pinned_at 0: free. */
static void hertz(const struct mech_whisker *w, double pinned_at, double out[MECH_MODES])
{
    struct mech_modes modes;
    struct mech_basis basis;
    mech_modes_of(w, &modes);
    mech_basis_of(w, &modes, pinned_at > 0, pinned_at > 0 ? pinned_at : w->length, TICK, &basis);
    for (int k = 0; k < MECH_MODES; k++)
        out[k] = basis.omega[k] / (2 * SIM_PI);
    qsort(out, MECH_MODES, sizeof *out, by_size);
}

/* Whisker physics, section 5: 0.2 % is what the last of its digits leaves. */
static void test_frequency_table(void **state)
{
    (void)state;
    const double inf = INFINITY;
    const struct {
        double kappa, young, pinned_at, hz[3];
    } table[] = {
        {inf, 2.5e9, 0, {22.8, 70.5, 155.8}},    {inf, 2.5e9, 0.140, {42.2, 117.2, 232.3}},
        {1, 2.5e9, 0, {16.3, 55.7, 131.1}},      {1, 2.5e9, 0.140, {29.9, 95.0, 199.9}},
        {1, 2.5e9, 0.110, {50.1, 108.6, 194.1}}, {inf, 1e9, 0, {14.4, 44.6, 98.6}},
        {inf, 2e9, 0, {20.4, 63.1, 139.4}},      {inf, 3.3e9, 0, {26.2, 81.1, 179.0}},
    };
    for (size_t i = 0; i < COUNT(table); i++) {
        struct mech_whisker w = with(table[i].kappa, table[i].young, 0.1);
        double got[MECH_MODES];
        hertz(&w, table[i].pinned_at, got);
        for (int k = 0; k < 3; k++)
            assert_near(got[k], table[i].hz[k], 0.06 + 0.002 * table[i].hz[k]);
    }
}

/* The textbook's coefficients of a sharp cone: omega = beta^2 sqrt(E I0 / (rho A0 L^4)). */
static void test_sharp_cone(void **state)
{
    (void)state;
    const double beta2[] = {8.719, 21.146, 38.454};
    struct mech_whisker w = with(INFINITY, 2.5e9, 0.1);
    w.cone = w.length * 1.0005;
    double got[MECH_MODES], area = SIM_PI / 4 * w.exit_diameter * w.exit_diameter;
    double unit = sqrt(mech_whisker_bending(&w) / (w.density * area)) / (w.length * w.length) / (2 * SIM_PI);
    hertz(&w, 0, got);
    for (int k = 0; k < 3; k++)
        assert_share(got[k], beta2[k] * unit, 0.01);
    struct mech_whisker ours = with(INFINITY, 2.5e9, 0.1);
    hertz(&ours, 0, got);
    assert_share(got[0],
                 5.967 * sqrt(mech_whisker_bending(&ours) / (ours.density * area)) / (0.14 * 0.14) / (2 * SIM_PI),
                 0.001);
}

/* Statics of either condition are those of the compliance, with as few modes as there are. */
static void test_settles_at_the_static_solution(void **state)
{
    (void)state;
    for (double s = 0.03; s < 0.141; s += 0.01) {
        struct mech_whisker w = with(1, 2.5e9, 0.15);
        struct mech_modes modes;
        struct mech_basis free, pinned;
        struct mech_motion motion = {{0}, {0}, 0};
        mech_modes_of(&w, &modes);
        mech_basis_of(&w, &modes, false, s, TICK, &free);
        mech_basis_of(&w, &modes, true, s, TICK, &pinned);
        assert_share(free.answer_static, mech_modes_compliance(&w, s, s), 1e-6);
        assert_share(free.moment_static, s, 1e-6);
        assert_share(pinned.answer_static, 1 / free.answer_static, 1e-6);
        assert_share(pinned.moment_static, s / free.answer_static, 1e-6);
        for (int i = 0; i < 4000; i++)
            mech_basis_step(&pinned, &motion, 1e-3);
        assert_share(mech_basis_moment(&pinned, &motion), 1e-3 * pinned.moment_static, 1e-6);
        assert_share(mech_basis_answer(&pinned, &motion), 1e-3 * pinned.answer_static, 1e-6);
    }
}

/* Pinned or free, the shape and the force stay when the condition changes. */
static void test_change_of_condition_loses_nothing(void **state)
{
    (void)state;
    struct mech_whisker w = with(1, 2.5e9, 0.1);
    struct mech_modes modes;
    struct mech_basis free, pinned;
    struct mech_motion motion = {{0}, {0}, 0};
    mech_modes_of(&w, &modes);
    mech_basis_of(&w, &modes, false, 0.11, TICK, &free);
    mech_basis_of(&w, &modes, true, 0.11, TICK, &pinned);
    for (int i = 1; i < 100; i++)
        mech_basis_step(&pinned, &motion, 1e-5 * i);
    double force = mech_basis_answer(&pinned, &motion), moment = mech_basis_moment(&pinned, &motion);
    double place = motion.input;
    mech_basis_change(&pinned, &free, &motion, force);
    assert_share(mech_basis_answer(&free, &motion), place, 1e-9);
    assert_share(mech_basis_moment(&free, &motion), moment, 1e-9);
    mech_basis_change(&free, &pinned, &motion, place);
    assert_share(mech_basis_answer(&pinned, &motion), force, 1e-9);
}

/* Bases that are moved are those that are made there. */
static void test_moved_bases(void **state)
{
    (void)state;
    struct mech_whisker w = with(1, 2.5e9, 0.1);
    struct mech_modes modes;
    struct mech_basis made[2], moved[2];
    mech_modes_of(&w, &modes);
    for (int pinned = 0; pinned < 2; pinned++) {
        mech_basis_of(&w, &modes, pinned, 0.08, TICK, &moved[pinned]);
        mech_basis_of(&w, &modes, pinned, 0.11, TICK, &made[pinned]);
    }
    mech_basis_move(&w, &modes, 0.11, &moved[0], &moved[1]);
    for (int pinned = 0; pinned < 2; pinned++) {
        struct mech_motion one, other;
        mech_basis_settle(&made[pinned], 1e-3, 0.01, &one);
        mech_basis_settle(&moved[pinned], 1e-3, 0.01, &other);
        for (int i = 1; i <= 50; i++) {
            mech_basis_step(&made[pinned], &one, 1e-5 * i);
            mech_basis_step(&moved[pinned], &other, 1e-5 * i);
        }
        assert_share(mech_basis_moment(&moved[pinned], &other), mech_basis_moment(&made[pinned], &one), 1e-12);
    }
}

/* Steps are exact: two of half a tick are one of a tick, for an input that grows linearly. */
static void test_steps_are_exact(void **state)
{
    (void)state;
    struct mech_whisker w = with(1, 2.5e9, 0.1);
    struct mech_modes modes;
    struct mech_basis whole, half;
    struct mech_motion a, b;
    mech_modes_of(&w, &modes);
    mech_basis_of(&w, &modes, true, 0.11, TICK, &whole);
    mech_basis_of(&w, &modes, true, 0.11, TICK / 2, &half);
    mech_basis_settle(&whole, 0, 0.01, &a);
    a.speed[0] += 1e-4;
    b = a;
    for (int i = 1; i <= 200; i++) {
        mech_basis_step(&whole, &a, 1e-5 * i);
        mech_basis_step(&half, &b, 1e-5 * (i - 0.5));
        mech_basis_step(&half, &b, 1e-5 * i);
    }
    for (int k = 0; k < MECH_MODES; k++)
        assert_near(a.at[k], b.at[k], 1e-12);
}

/* A whisker that is let go rings at its first free mode and fades by its damping ratio. */
static void test_release_rings(void **state)
{
    (void)state;
    struct mech_whisker w = with(1, 2.5e9, 0.05);
    struct mech_modes modes;
    struct mech_basis free, pinned;
    struct mech_motion motion;
    mech_modes_of(&w, &modes);
    mech_basis_of(&w, &modes, false, 0.11, TICK, &free);
    mech_basis_of(&w, &modes, true, 0.11, TICK, &pinned);
    mech_basis_settle(&pinned, 5e-3, 0, &motion);
    mech_basis_change(&pinned, &free, &motion, 0);
    double last = 0, rise[8] = {0}, top[9] = {0};
    int count = 0;
    for (int i = 0; i < 2000 && count < 8; i++) {
        mech_basis_step(&free, &motion, 0);
        double now = motion.at[0];
        top[count] = fmax(top[count], now);
        if (last < 0 && now >= 0)
            rise[count++] = i + last / (last - now);
        last = now;
    }
    double omega = 2 * SIM_PI * 7 / ((rise[7] - rise[0]) * TICK);
    assert_share(omega / sqrt(1 - 0.05 * 0.05), 2 * SIM_PI * 16.34, 0.002);
    assert_near(log(top[3] / top[4]), 2 * SIM_PI * 0.05 / sqrt(1 - 0.05 * 0.05), 0.02);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_frequency_table),
        cmocka_unit_test(test_sharp_cone),
        cmocka_unit_test(test_settles_at_the_static_solution),
        cmocka_unit_test(test_change_of_condition_loses_nothing),
        cmocka_unit_test(test_moved_bases),
        cmocka_unit_test(test_steps_are_exact),
        cmocka_unit_test(test_release_rings),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
