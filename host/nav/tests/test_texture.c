#include "texture.h"

#include "near.h"

/* Two classes, one axis, four bins of 10 counts from -20: class 0 sits in bin 1, class 1 in bins 2 and 3. */
static struct nav_texture *hand_model(void)
{
    const double low = -20.0, high = 20.0;
    const double calm[] = {-5.0, -5.0, -1.0}, rough[] = {5.0, 15.0, 15.0};
    struct nav_texture *t = nav_texture_new(2, 1, 4, &low, &high);
    assert_non_null(t);
    assert_int_equal(nav_texture_add(t, 0, calm, 3), 3);
    assert_int_equal(nav_texture_add(t, 1, rough, 3), 3);
    nav_texture_finish(t, 1.0);
    return t;
}

static void log_likelihood_is_the_sum_over_samples_of_log_bin_shares(void **state)
{
    (void)state;
    struct nav_texture *t = hand_model();
    /* Laplace: class 0 has (1, 4, 1, 1) / 7, class 1 has (1, 1, 2, 3) / 7. */
    const double window[] = {-3.0, 12.0};
    double loglik[2];
    assert_int_equal(nav_texture_loglik(t, window, 2, loglik), 2);
    assert_near(loglik[0], log(4.0 / 7.0) + log(1.0 / 7.0), 1e-12);
    assert_near(loglik[1], log(1.0 / 7.0) + log(3.0 / 7.0), 1e-12);
    nav_texture_free(t);
}

static void samples_beyond_the_range_count_in_the_end_bins(void **state)
{
    (void)state;
    struct nav_texture *t = hand_model();
    const double window[] = {-1e9, 1e9};
    double loglik[2];
    nav_texture_loglik(t, window, 2, loglik);
    assert_near(loglik[0], 2.0 * log(1.0 / 7.0), 1e-12);
    assert_near(loglik[1], log(1.0 / 7.0) + log(3.0 / 7.0), 1e-12);
    nav_texture_free(t);
}

static void samples_that_are_not_finite_are_skipped(void **state)
{
    (void)state;
    struct nav_texture *t = hand_model();
    const double window[] = {NAN, -INFINITY, INFINITY};
    double loglik[2] = {9.0, 9.0};
    assert_int_equal(nav_texture_loglik(t, window, 3, loglik), 0);
    assert_near(loglik[0], 0.0, 0.0);
    assert_near(loglik[1], 0.0, 0.0);
    nav_texture_free(t);
}

static void both_axes_add_evidence(void **state)
{
    (void)state;
    const double low[] = {0.0, 0.0}, high[] = {2.0, 2.0};
    const double a[] = {0.5, 0.5}, b[] = {0.5, 1.5};
    struct nav_texture *t = nav_texture_new(2, 2, 2, low, high);
    nav_texture_add(t, 0, a, 1);
    nav_texture_add(t, 1, b, 1);
    nav_texture_finish(t, 1.0);
    double loglik[2];
    nav_texture_loglik(t, b, 1, loglik);
    assert_near(loglik[1] - loglik[0], log(2.0 / 3.0) - log(1.0 / 3.0), 1e-12);
    nav_texture_free(t);
}

static void impossible_sizes_make_no_model(void **state)
{
    (void)state;
    const double low = 1.0, high = 1.0, top = 2.0, nan_edge = NAN;
    assert_null(nav_texture_new(2, 1, 4, &low, &high));
    assert_null(nav_texture_new(0, 1, 4, &low, &top));
    assert_null(nav_texture_new(2, 1, 0, &low, &top));
    assert_null(nav_texture_new(2, 1, 4, &nan_edge, &top));
    struct nav_texture *t = nav_texture_new(2, 1, 4, &low, &top);
    assert_int_equal(nav_texture_add(t, 2, &low, 1), -1);
    nav_texture_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(log_likelihood_is_the_sum_over_samples_of_log_bin_shares),
        cmocka_unit_test(samples_beyond_the_range_count_in_the_end_bins),
        cmocka_unit_test(samples_that_are_not_finite_are_skipped),
        cmocka_unit_test(both_axes_add_evidence),
        cmocka_unit_test(impossible_sizes_make_no_model),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
