#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "beam.h"
#include "robot.h"
#include "texture_whisker.h"

#define PART_PER_MILLION(x) (fabs(x) * 1e-6)

/* Whisker physics, section 1. */
static void test_derived_geometry(void **state)
{
    (void)state;
    assert_near(SIM_WHISKER_TAPER, 7.1875e-3, 1e-12);
    assert_near(SIM_WHISKER_EXIT_DIAMETER, 1.30625e-3, 1e-12);
    assert_near(SIM_WHISKER_CONE_M, 181.739e-3, 0.5e-6);
    assert_near(SIM_WHISKER_I0, 1.429141e-13, 0.5e-19);
    assert_near(SIM_WHISKER_E * SIM_WHISKER_I0, 3.572853e-4, 0.5e-10);
}

/* Whisker physics, section 2: theta = 5 degrees, E = 2.5 GPa, checked there against a beam of 200 finite elements. */
static const struct {
    double a_mm, moment_unm, force_mn, tilt_1, tilt_3, tilt_03;
} TABLE[] = {
    {80, 654.5357, 8.18170, 2.799043, 1.488550, 4.045643},  {90, 524.6231, 5.82915, 2.523923, 1.268029, 3.863054},
    {100, 420.6930, 4.20693, 2.248804, 1.070615, 3.657588}, {110, 335.6593, 3.05145, 1.973684, 0.892857, 3.424658},
    {120, 264.7979, 2.20665, 1.698565, 0.731959, 3.158363}, {130, 204.8383, 1.57568, 1.423445, 0.585630, 2.850982},
    {140, 153.4443, 1.09603, 1.148325, 0.451977, 2.492212},
};

static void test_bending_table(void **state)
{
    (void)state;
    const double theta = 5 * SIM_DEGREE;
    for (size_t i = 0; i < sizeof TABLE / sizeof TABLE[0]; i++) {
        double a = TABLE[i].a_mm * 1e-3;
        assert_near(sim_beam_moment_clamped(a, theta) * 1e6, TABLE[i].moment_unm, 0.6e-4);
        assert_near(sim_beam_moment_clamped(a, theta) / a * 1e3, TABLE[i].force_mn, 0.6e-5);
        assert_near(sim_beam_stiffness(a) * a * theta * 1e3, TABLE[i].force_mn, 0.6e-5);
        assert_near(sim_beam_tilt(a, theta, 1) / SIM_DEGREE, TABLE[i].tilt_1, 0.6e-6);
        assert_near(sim_beam_tilt(a, theta, 3) / SIM_DEGREE, TABLE[i].tilt_3, 0.6e-6);
        assert_near(sim_beam_tilt(a, theta, 0.3) / SIM_DEGREE, TABLE[i].tilt_03, 0.6e-6);
    }
}

static void test_single_vectors(void **state)
{
    (void)state;
    assert_near(1e-3 / sim_beam_stiffness(0.110), 3.145821e-3, 0.6e-9);
    assert_near(sim_beam_plug_stiffness(1), 5.897771e-3, 0.6e-9);
}

/* The plug's moment is its stiffness times its tilt, and a very stiff plug is a clamp. */
static void test_moment_in_the_plug(void **state)
{
    (void)state;
    for (double a = 0.08; a < 0.141; a += 0.01) {
        for (double kappa = 0.1; kappa < 101; kappa *= 10) {
            double wanted = sim_beam_plug_stiffness(kappa) * sim_beam_tilt(a, 0.1, kappa);
            assert_near(sim_beam_moment(a, 0.1, kappa), wanted, PART_PER_MILLION(wanted));
        }
        double clamped = sim_beam_moment_clamped(a, 0.1);
        assert_near(sim_beam_moment(a, 0.1, 1e9), clamped, PART_PER_MILLION(clamped));
    }
}

/* Whisker physics, section 4: RMS residual of the least-squares line r = a1 f1 + a0 through six positions 90..140 mm.
 */
static double line_residual_mm(double kappa)
{
    double f[6], r[6], mean_f = 0, mean_r = 0, ff = 0, fr = 0, rr = 0;
    for (int i = 0; i < 6; i++) {
        r[i] = 90 + 10 * i;
        f[i] = sim_beam_tilt(r[i] * 1e-3, 1, kappa);
        mean_f += f[i] / 6;
        mean_r += r[i] / 6;
    }
    for (int i = 0; i < 6; i++) {
        ff += (f[i] - mean_f) * (f[i] - mean_f);
        fr += (f[i] - mean_f) * (r[i] - mean_r);
        rr += (r[i] - mean_r) * (r[i] - mean_r);
    }
    return sqrt(fmax(0, rr - fr * fr / ff) / 6);
}

static void test_linear_fit_residuals(void **state)
{
    (void)state;
    const double table[][2] = {{0.1, 2.93}, {0.3, 1.74}, {1, 0.00}, {3, 1.22}, {10, 1.86}, {100, 2.16}, {1e9, 2.20}};
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        assert_near(line_residual_mm(table[i][0]), table[i][1], 0.006);
}

/* Whisker physics, section 7: what a tip on the floor does follows from the same beam. */
static void test_tip_constants(void **state)
{
    (void)state;
    const double a = SIM_WHISKER_OUTSIDE_M;
    double bending = 1 / sim_beam_stiffness(a), plug = a * a / sim_beam_plug_stiffness(SIM_PLUG_KAPPA);
    assert_near(1 / (bending + plug), SIM_TIP_STIFFNESS, 0.6e-4);
    assert_near(sim_beam_tilt(a, 1e-3 / a, SIM_PLUG_KAPPA) / SIM_DEGREE, SIM_TIP_TILT_DEG_PER_MM, 0.6e-4);
    assert_near(sim_texture_whisker_slip_mm(sim_floor_texture("ROUGH")), 1.52, 0.006);
    assert_near(sim_texture_whisker_slip_mm(sim_floor_texture("VINYL")), 0.51, 0.006);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_derived_geometry),     cmocka_unit_test(test_bending_table),
        cmocka_unit_test(test_single_vectors),       cmocka_unit_test(test_moment_in_the_plug),
        cmocka_unit_test(test_linear_fit_residuals), cmocka_unit_test(test_tip_constants),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
