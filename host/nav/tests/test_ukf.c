/* The unscented Kalman filter where it must equal a Kalman filter, and where it differs from a linearisation; its state
 * is looked at, so its source is part of this program. */
#include "../filter/ukf.c"

#include "kalman_rooms.h"

static void its_points_have_the_beliefs_moments(void **state)
{
    (void)state;
    const struct nav_gaussian g = {.covariance = {0.04, 0.01, -0.002, 0.01, 0.09, 0.003, -0.002, 0.003, 0.01}};
    double sum[9] = {0.0}, mean[3] = {0.0}, d[3];
    for (int n = 0; n < POINTS; n++) {
        offset(&g, n, d);
        for (int a = 0; a < 9; a++)
            sum[a] += d[a / 3] * d[a % 3] / POINTS;
        for (int a = 0; a < 3; a++)
            mean[a] += d[a] / POINTS;
    }
    for (int a = 0; a < 9; a++)
        assert_near(sum[a], g.covariance[a], 1e-12);
    for (int a = 0; a < 3; a++)
        assert_near(mean[a], 0.0, 1e-12);
}

static void a_contact_square_on_is_a_kalman_update(void **state)
{
    (void)state;
    struct nav_problem p = facing_wall();
    struct nav_kalman *k = create(&p);
    read_distance(k, 0.14);
    assert_contact_is_a_kalman_update(k);
    assert_int_equal(k->evaluations, 6);
    nav_kalman_destroy(k);
}

static void a_heading_that_is_unsure_lengthens_the_expected_range(void **state)
{
    (void)state;
    struct nav_problem p = facing_wall();
    p.prior.sigma[0] = p.prior.sigma[1] = 1e-5;
    p.prior.sigma[2] = 0.2;
    struct nav_kalman *k = create(&p);
    struct nav_linear l;
    const struct nav_sighting s = {.ray = 0, .reach = 1.0};
    assert_true(linearise(k, &s, &l));
    /* Two of six points are turned by 0.2 sqrt(3): the range grows by 0.2 (1 / cos - 1) there, as a straight line of
     * derivatives would never say. */
    assert_near(l.expected, 0.15 + (2.0 / 6.0) * 0.2 * (1.0 / cos(0.2 * sqrt(3.0)) - 1.0), 1e-6);
    assert_near(l.cross[2], 0.0, 1e-9); /* it grows to both sides */
    nav_kalman_destroy(k);
}

static void a_border_crossed_puts_the_tip_on_the_line(void **state)
{
    (void)state;
    struct nav_problem p = behind_the_border();
    struct nav_kalman *k = create(&p);
    cross(k);
    double gain = 0.0025 / (0.0025 + 0.0002); /* as worked out in test_ekf.c */
    assert_near(k->belief.mean.x, 0.3 + 8 * 0.02 + gain * 0.01, 1e-6);
    assert_near(k->belief.covariance[0], 0.0025 * (1.0 - gain), 1e-8);
    nav_kalman_destroy(k);
}

static void nothing_read_changes_nothing(void **state)
{
    (void)state;
    struct nav_problem p = facing_wall();
    struct nav_kalman *k = create(&p);
    struct nav_gaussian before = k->belief;
    nav_kalman_update(k, &(struct nav_evidence){NULL, NOTHING_READ});
    assert_memory_equal(&before, &k->belief, sizeof before);
    assert_int_equal(k->evaluations, 0);
    nav_kalman_destroy(k);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(its_points_have_the_beliefs_moments),
        cmocka_unit_test(a_contact_square_on_is_a_kalman_update),
        cmocka_unit_test(a_heading_that_is_unsure_lengthens_the_expected_range),
        cmocka_unit_test(a_border_crossed_puts_the_tip_on_the_line),
        cmocka_unit_test(nothing_read_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
