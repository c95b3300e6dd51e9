#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "mech_vibration.h"
#include "near.h"

/* Whisker physics, section 1. */
static void test_geometry(void **state)
{
    (void)state;
    struct mech_whisker w = mech_whisker_default();
    struct mech_modes modes;
    mech_modes_of(&w, &modes);
    assert_near(w.exit_diameter, 1.30625e-3, 1e-12);
    assert_near(w.cone, 181.739e-3, 0.5e-6);
    assert_near(mech_whisker_bending(&w), 3.572853e-4, 0.5e-10);
    assert_near(modes.mass_total, 96.24e-6, 0.005e-6);
    assert_near(1 / mech_whisker_compliance(&w), 5.897771e-3, 0.5e-9); /* k* */
    struct mech_whisker other = w;
    other.exit_diameter = 1.45e-3;
    other = mech_whisker_with_tip(other, 1.45e-3 - 7.1875e-3 * 0.140);
    assert_near(other.exit_diameter / 7.1875e-3, other.cone, 1e-9);
}

/* Section 2: theta = 5 degrees, checked there against a beam of 200 finite elements to 1e-7. */
static const struct {
    double a_mm, moment_unm, force_mn, tilt_1, tilt_3, tilt_03;
} TABLE[] = {
    {80, 654.5357, 8.18170, 2.799043, 1.488550, 4.045643},  {90, 524.6231, 5.82915, 2.523923, 1.268029, 3.863054},
    {100, 420.6930, 4.20693, 2.248804, 1.070615, 3.657588}, {110, 335.6593, 3.05145, 1.973684, 0.892857, 3.424658},
    {120, 264.7979, 2.20665, 1.698565, 0.731959, 3.158363}, {130, 204.8383, 1.57568, 1.423445, 0.585630, 2.850982},
    {140, 153.4443, 1.09603, 1.148325, 0.451977, 2.492212},
};

static struct mech_whisker with_kappa(double kappa)
{
    struct mech_whisker w = mech_whisker_default();
    w.kappa = kappa;
    return w;
}

static void test_closed_form_table(void **state)
{
    (void)state;
    const double theta = 5 * SIM_DEGREE;
    struct mech_whisker clamped = with_kappa(INFINITY), one = with_kappa(1), three = with_kappa(3),
                        soft = with_kappa(0.3);
    for (size_t i = 0; i < COUNT(TABLE); i++) {
        double a = TABLE[i].a_mm * 1e-3;
        assert_near(mech_whisker_moment(&clamped, a, theta) * 1e6, TABLE[i].moment_unm, 0.6e-4);
        assert_near(mech_whisker_stiffness(&clamped, a) * a * theta * 1e3, TABLE[i].force_mn, 0.6e-5);
        assert_near(mech_whisker_tilt(&one, a, theta) / SIM_DEGREE, TABLE[i].tilt_1, 0.6e-6);
        assert_near(mech_whisker_tilt(&three, a, theta) / SIM_DEGREE, TABLE[i].tilt_3, 0.6e-6);
        assert_near(mech_whisker_tilt(&soft, a, theta) / SIM_DEGREE, TABLE[i].tilt_03, 0.6e-6);
    }
    assert_near(1e-3 / mech_whisker_stiffness(&clamped, 0.110), 3.145821e-3, 0.6e-9);
}

/* The compliance that the modes are made of is that of the closed form: independent derivations. */
static void test_compliance_is_the_closed_forms(void **state)
{
    (void)state;
    struct mech_whisker clamped = with_kappa(INFINITY), one = with_kappa(1);
    for (double a = 0.02; a < 0.141; a += 0.02) {
        assert_share(mech_modes_compliance(&clamped, a, a), 1 / mech_whisker_stiffness(&clamped, a), 1e-8);
        double with_plug = a * a / mech_whisker_moment(&one, a, 1);
        assert_share(mech_modes_compliance(&one, a, a), with_plug, 1e-8);
    }
}

/* Least-squares line r = a1 f + a0 through points; returns its RMS residual. */
static double line_rms(const double *f, const double *r, int n)
{
    double mf = 0, mr = 0, ff = 0, fr = 0, sum = 0;
    for (int i = 0; i < n; i++) {
        mf += f[i] / n;
        mr += r[i] / n;
    }
    for (int i = 0; i < n; i++) {
        ff += (f[i] - mf) * (f[i] - mf);
        fr += (f[i] - mf) * (r[i] - mr);
    }
    for (int i = 0; i < n; i++) {
        double off = r[i] - mr - fr / ff * (f[i] - mf);
        sum += off * off / n;
    }
    return sqrt(sum);
}

static double rms_of_line(double kappa, double first_mm, double displacement)
{
    struct mech_whisker w = with_kappa(kappa);
    double f[8], r[8];
    int n = 0;
    for (double mm = first_mm; mm < 141; mm += 10, n++) {
        double theta = displacement > 0 ? displacement / (mm * 1e-3) : 5 * SIM_DEGREE;
        f[n] = mech_whisker_moment(&w, mm * 1e-3, theta);
        r[n] = mm;
    }
    return line_rms(f, r, n);
}

/* Section 4: residual of eq. 3, noise free; the moment is the tilt's multiple, so the clamped whisker counts too. */
static void test_residual_of_the_line(void **state)
{
    (void)state;
    const double kappa[] = {0.1, 0.3, 1, 3, 10, 100, INFINITY}, rms[] = {2.93, 1.74, 0, 1.22, 1.86, 2.16, 2.20};
    for (size_t i = 0; i < COUNT(kappa); i++)
        assert_near(rms_of_line(kappa[i], 90, 0), rms[i], 0.006);
    assert_near(rms_of_line(INFINITY, 80, 0), 3.21, 0.006);
    assert_near(rms_of_line(INFINITY, 90, 0.01), 3.72, 0.006);
    const double stiffness[] = {10e-3, 5e-3, 3e-3}, moved[] = {2.62, 2.06, 1.67};
    for (size_t i = 0; i < COUNT(moved); i++)
        assert_near(rms_of_line(stiffness[i] / 5.897771e-3, 90, 0.01), moved[i], 0.006);
}

/* Section 6: gain of the dipole for a small tilt, and 13.68 degrees at 5. */
static void test_field(void **state)
{
    (void)state;
    const struct {
        double pivot_mm, gap_mm, gain;
    } list[] = {{0, 2, 0.5}, {3, 2, 2.75}, {2, 1.5, 2.5}, {5, 2, 4.25}};
    struct mech_whisker w = mech_whisker_default();
    for (size_t i = 0; i < COUNT(list); i++) {
        w.pivot = list[i].pivot_mm * 1e-3;
        w.gap = list[i].gap_mm * 1e-3;
        assert_share(mech_whisker_field(&w, 1e-4) / 1e-4, list[i].gain, 1e-6);
        assert_near(mech_whisker_field(&w, -0.1), -mech_whisker_field(&w, 0.1), 1e-12);
    }
    w = mech_whisker_default();
    assert_near(mech_whisker_field(&w, 5 * SIM_DEGREE) / SIM_DEGREE, 13.68, 0.006);
    double field[2], tilt[2] = {0.03, -0.04};
    mech_whisker_fields(&w, tilt, field);
    assert_near(hypot(field[0], field[1]), mech_whisker_field(&w, 0.05), 1e-12);
    assert_near(field[0] / field[1], -0.75, 1e-12);
    for (double small = 0.001; small < 0.031; small += 0.001) { /* a series below 0.03 rad */
        mech_whisker_fields(&w, (double[2]){0.6 * small, 0.8 * small}, field);
        assert_share(hypot(field[0], field[1]), mech_whisker_field(&w, small), 1e-4);
    }
}

/* Section 7: static transfer at the tip. */
static void test_tip(void **state)
{
    (void)state;
    struct mech_whisker one = with_kappa(1), clamped = with_kappa(INFINITY);
    assert_near(mech_whisker_tip_stiffness(&one), 0.0691, 0.00005);
    assert_near(mech_whisker_tip_stiffness(&clamped), 0.0897, 0.00005);
    assert_near(mech_whisker_tilt(&one, 0.140, 1e-3 / 0.140) / SIM_DEGREE, 0.0940, 0.00005);
    const double preload_mm[] = {2, 5, 10}, force_mn[] = {0.14, 0.35, 0.69};
    for (size_t i = 0; i < COUNT(force_mn); i++)
        assert_near(mech_whisker_tip_stiffness(&one) * preload_mm[i], force_mn[i], 0.006);
}

/* Section 5: sag of a horizontal whisker under its weight, from the compliance and the modes' masses. */
static void test_gravity(void **state)
{
    (void)state;
    struct mech_whisker w = with_kappa(INFINITY);
    struct mech_modes modes;
    double sag = 0, moment = 0;
    mech_modes_of(&w, &modes);
    for (int i = 0; i < MECH_NODES; i++) {
        sag += 9.81 * modes.mass[i] * mech_modes_compliance(&w, w.length, modes.node[i]);
        moment += 9.81 * modes.mass[i] * modes.node[i];
    }
    assert_near(sag * 1e3, 1.03, 0.006);
    assert_near(moment * 1e6, 41.7, 0.06);
    assert_near(moment / 5.897771e-3 / SIM_DEGREE, 0.405, 0.0006);
}

/* Section 6's ranges, and that a batch keeps within them and differs. */
static void test_batch(void **state)
{
    (void)state;
    size_t count;
    const struct mech_unknown *unknown = mech_unknowns(&count);
    for (size_t i = 0; i < count; i++)
        assert_true(unknown[i].low <= unknown[i].typical && unknown[i].typical <= unknown[i].high);
    double sum = 0, squares = 0;
    enum { BATCH = 400 };
    for (uint32_t i = 0; i < BATCH; i++) {
        struct mech_whisker w = mech_whisker_draw(7, i);
        assert_in_range((int)(1000 * w.kappa), 700, 1300);
        assert_in_range((int)(1000 * w.damping), 50, 150);
        assert_in_range((int)(1000 * w.friction), 200, 400);
        sum += w.gain;
        squares += (w.gain - 1) * (w.gain - 1);
    }
    assert_near(sum / BATCH, 1, 0.005);
    assert_near(sqrt(squares / BATCH), 0.025, 0.003);
    struct mech_whisker a = mech_whisker_draw(7, 3), b = mech_whisker_draw(7, 3);
    assert_memory_equal(&a, &b, sizeof a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_geometry),
        cmocka_unit_test(test_closed_form_table),
        cmocka_unit_test(test_compliance_is_the_closed_forms),
        cmocka_unit_test(test_residual_of_the_line),
        cmocka_unit_test(test_field),
        cmocka_unit_test(test_tip),
        cmocka_unit_test(test_gravity),
        cmocka_unit_test(test_batch),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
