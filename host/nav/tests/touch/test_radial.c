#include "radial.h"

#include "near.h"

static void peak_is_the_largest_length_about_rest(void **state)
{
    (void)state;
    const double rest[] = {100.0, 200.0};
    const double samples[] = {100.0, 200.0, 103.0, 204.0, 94.0, 192.0, NAN, 900.0};
    assert_near(nav_radial_peak(samples, 4, 2, rest), 10.0, 1e-12);
    assert_true(isnan(nav_radial_peak(samples + 6, 1, 2, rest)));
    assert_true(isnan(nav_radial_peak(samples, 0, 2, rest)));
}

static void fit_is_the_least_squares_line_with_its_standard_error(void **state)
{
    (void)state;
    /* r = 4 - f plus residuals (1, -1, -1, 1) / 2, which are orthogonal to f and to the constant. */
    const double f[] = {0.0, 1.0, 2.0, 3.0}, r[] = {4.5, 2.5, 1.5, 1.5};
    struct nav_radial model;
    assert_int_equal(nav_radial_fit(&model, f, r, 4), 4);
    assert_near(model.a1, -1.0, 1e-12);
    assert_near(model.a0, 4.0, 1e-12);
    assert_near(model.sigma_mm, sqrt(1.0 / 2.0), 1e-12);
    assert_near(model.low_mm, 1.5, 0.0);
    assert_near(model.high_mm, 4.5, 0.0);
    assert_near(nav_radial_predict(&model, 2.5), 1.5, 1e-12);
}

static void contacts_that_are_not_finite_are_left_out_of_the_fit(void **state)
{
    (void)state;
    const double f[] = {0.0, NAN, 1.0, 2.0, 5.0}, r[] = {3.0, 1.0, 2.0, 1.0, INFINITY};
    struct nav_radial model;
    assert_int_equal(nav_radial_fit(&model, f, r, 5), 3);
    assert_near(model.a1, -1.0, 1e-12);
    assert_near(model.sigma_mm, 0.0, 1e-7);
}

static void too_little_data_fits_nothing(void **state)
{
    (void)state;
    const double f[] = {1.0, 1.0, 1.0, 2.0}, r[] = {3.0, 2.0, 1.0, 5.0};
    struct nav_radial model = {.a1 = 7.0};
    assert_int_equal(nav_radial_fit(&model, f, r, 3), -1);
    assert_int_equal(nav_radial_fit(&model, f + 2, r + 2, 2), -1);
    assert_near(model.a1, 7.0, 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(peak_is_the_largest_length_about_rest),
        cmocka_unit_test(fit_is_the_least_squares_line_with_its_standard_error),
        cmocka_unit_test(contacts_that_are_not_finite_are_left_out_of_the_fit),
        cmocka_unit_test(too_little_data_fits_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
