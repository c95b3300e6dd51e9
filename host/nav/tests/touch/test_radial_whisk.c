#include "radial_whisk.h"

#include "near.h"
#include "whisks.h"

#define CONE 180.0
#define GAIN 20000.0 /* counts per rad of tilt */
#define RATE 0.13

static struct nav_whisk_model model(double spread)
{
    struct nav_whisk_model m = {.axes = 2,
                                .kappa = 1.0,
                                .cone_mm = CONE,
                                .weight = {[NAV_WHISK_TURN] = 1.0},
                                .mean = {[NAV_WHISK_TURN] = log(RATE * 0.6), [NAV_WHISK_RATE] = log(RATE)},
                                .scatter = {0.05, 0.0, 0.0, 0.02, 0.02},
                                .spread = spread,
                                .low_mm = 80.0,
                                .high_mm = 140.0,
                                .tip_mm = 135.0,
                                .direction = {0.6, -0.8},
                                .direction_sd = 0.05,
                                .log_misfit = log(0.005),
                                .log_misfit_sd = 1.0};
    m.log_gain = log(GAIN) + m.mean[NAV_WHISK_TURN];
    return m;
}

static struct drawn_whisk whisk_at(double radius_mm)
{
    struct drawn_whisk w = usual_whisk();
    w.rate = RATE;
    w.peak = GAIN * RATE * w.push_s * (1.0 - radius_mm / CONE);
    return w;
}

static struct nav_whisk_estimate reported(const struct nav_whisk_model *m, const struct drawn_whisk *w)
{
    struct nav_shape shape = shape_of_whisk(w, m->axes);
    struct nav_whisk_estimate e;
    nav_whisk_estimate(m, &shape, &e);
    assert_true(isfinite(e.radius_mm) && e.sigma_mm > 0.0 && e.tip >= 0.0 && e.tip <= 1.0);
    assert_true(e.confidence >= 0.0 && e.confidence <= 1.0);
    assert_true(e.radius_mm >= m->low_mm && e.radius_mm <= m->high_mm);
    return e;
}

static void height_is_equation_3_and_the_clamped_law_at_its_ends(void **state)
{
    (void)state;
    assert_near(nav_whisk_height(1.0, CONE, 90.0), log(0.5), 1e-12);
    double clamped = nav_whisk_height(1e9, CONE, 100.0) - nav_whisk_height(1e9, CONE, 130.0);
    assert_near(clamped, log((1 / 100.0 - 1 / CONE) / (1 / 130.0 - 1 / CONE)), 1e-6);
    assert_true(isinf(nav_whisk_height(1.0, CONE, CONE)));
}

static void radius_and_its_deviation(void **state)
{
    (void)state;
    struct nav_whisk_model m = model(0.03);
    for (double radius = 90.0; radius < 131.0; radius += 10.0) {
        struct drawn_whisk whisk = whisk_at(radius);
        struct nav_whisk_estimate e = reported(&m, &whisk);
        assert_near(e.radius_mm, radius, 0.7);
        assert_near(e.sigma_mm, 0.03 * (CONE - radius), 0.25);
        assert_true(e.confidence > 0.98);
    }
}

static void a_longer_or_faster_push_is_no_nearer_contact(void **state)
{
    (void)state;
    struct nav_whisk_model m = model(0.02);
    struct drawn_whisk w = whisk_at(110.0);
    w.push_s *= 1.3;
    w.peak *= 1.3;
    assert_near(reported(&m, &w).radius_mm, 110.0, 0.8);
    w = whisk_at(110.0);
    w.rate *= 2.0;
    w.peak *= 2.0;
    assert_near(reported(&m, &w).radius_mm, 110.0, 0.8);
}

static void the_tip_is_reported_from_the_shaft(void **state)
{
    (void)state;
    struct nav_whisk_model m = model(0.02);
    struct drawn_whisk tip = whisk_at(138.5), shaft = whisk_at(131.0);
    assert_true(reported(&m, &tip).tip > 0.8);
    assert_true(reported(&m, &shaft).tip < 0.05);
}

static void what_fits_no_calibrated_whisk_is_doubted(void **state)
{
    (void)state;
    struct nav_whisk_model m = model(0.03);
    struct drawn_whisk usual = whisk_at(110.0), wild = whisk_at(110.0), none = whisk_at(110.0),
                       frozen = whisk_at(110.0);
    wild.peak *= 6.0;
    none.peak = 0.0;
    frozen.frozen_s = 0.5;
    struct drawn_whisk strange[] = {wild, none, frozen};
    for (int i = 0; i < 3; i++) {
        struct nav_whisk_estimate e = reported(&m, &strange[i]);
        assert_true(e.confidence < 0.2);
        assert_true(e.sigma_mm > 12.0);
    }
    struct nav_whisk_model other = model(0.03);
    other.direction[0] = -0.6;
    other.direction[1] = 0.8;
    assert_true(reported(&other, &usual).confidence < 0.5);
}

static void a_peak_alone_is_less_sure(void **state)
{
    (void)state;
    struct nav_whisk_model m = model(0.03);
    struct drawn_whisk w = whisk_at(110.0);
    struct nav_shape shape = shape_of_whisk(&w, 2);
    struct nav_whisk_estimate whole, peak;
    nav_whisk_estimate(&m, &shape, &whole);
    shape.quality = NAV_SHAPE_PEAK;
    nav_whisk_estimate(&m, &shape, &peak);
    assert_near(peak.radius_mm, 110.0, 1.5);
    assert_true(peak.sigma_mm > 1.5 * whole.sigma_mm);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(height_is_equation_3_and_the_clamped_law_at_its_ends),
        cmocka_unit_test(radius_and_its_deviation),
        cmocka_unit_test(a_longer_or_faster_push_is_no_nearer_contact),
        cmocka_unit_test(the_tip_is_reported_from_the_shaft),
        cmocka_unit_test(what_fits_no_calibrated_whisk_is_doubted),
        cmocka_unit_test(a_peak_alone_is_less_sure),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
