#include "gaussian.h"
#include "mixture.h"

#include "filter.h"
#include "near.h"
#include "rooms.h"

static const struct nav_noise NO_NOISE = {0.0, 0.0};

static void a_step_is_taken_in_the_frame_it_starts_in(void **state)
{
    (void)state;
    struct nav_pose end = nav_compose((struct nav_pose){1.0, 2.0, NAV_PI / 6.0}, (struct nav_pose){0.2, 0.4, 0.1});
    assert_near(end.x, 1.0 + 0.2 * sqrt(0.75) - 0.4 * 0.5, 1e-12);
    assert_near(end.y, 2.0 + 0.2 * 0.5 + 0.4 * sqrt(0.75), 1e-12);
    assert_near(end.theta, NAV_PI / 6.0 + 0.1, 1e-12);
    assert_near(nav_wrap(3.0 * NAV_PI + 0.25), 0.25 - NAV_PI, 1e-12);
}

static void moving_turns_heading_error_into_sideways_error(void **state)
{
    (void)state;
    struct nav_gaussian g = {.mean = {1.0, 2.0, NAV_PI / 2.0}, .covariance = {0.01, 0, 0, 0, 0.04, 0, 0, 0, 0.09}};
    nav_gaussian_move(&g, (struct nav_pose){2.0, 0.0, 0.5}, &(struct nav_noise){0.001, 0.002});
    assert_near(g.mean.x, 1.0, 1e-12);
    assert_near(g.mean.y, 4.0, 1e-12);
    assert_near(g.mean.theta, NAV_PI / 2.0 + 0.5, 1e-12);
    assert_near(g.covariance[0], 0.01 + 4.0 * 0.09 + 0.001, 1e-12);
    assert_near(g.covariance[4], 0.04 + 0.001, 1e-12);
    assert_near(g.covariance[2], -2.0 * 0.09, 1e-12);
    assert_near(g.covariance[6], -2.0 * 0.09, 1e-12);
    assert_near(g.covariance[8], 0.09 + 0.002, 1e-12);
}

/* Against J P J' with J = [1 0 a; 0 1 b; 0 0 1], where the end point lies (b, -a) from the start. */
static void moving_carries_what_is_known_of_position_and_heading_together(void **state)
{
    (void)state;
    const double c[9] = {0.04, 0.01, 0.012, 0.01, 0.09, -0.02, 0.012, -0.02, 0.05};
    const double a = -0.4, b = 0.3, jacobian[9] = {1.0, 0.0, a, 0.0, 1.0, b, 0.0, 0.0, 1.0};
    struct nav_gaussian g = {.mean = {1.0, 2.0, 0.0}};
    for (int i = 0; i < 9; i++)
        g.covariance[i] = c[i];
    nav_gaussian_move(&g, (struct nav_pose){b, -a, 0.2}, &NO_NOISE);
    for (int i = 0; i < 9; i++) {
        double sum = 0.0;
        for (int n = 0; n < 9; n++)
            sum += jacobian[i / 3 * 3 + n / 3] * c[n] * jacobian[i % 3 * 3 + n % 3];
        assert_near(g.covariance[i], sum, 1e-12);
    }
}

/* Variance of a uniform distribution: width^2 / 12. */
static void a_robot_that_may_be_anywhere_is_in_the_middle_give_or_take_the_arena(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.arena.size_x = 3.0;
    p.arena.size_y = 1.2;
    p.prior.uniform = true;
    struct nav_gaussian g = nav_mixture_prior(&p);
    const double variances[9] = {9.0 / 12.0, 0, 0, 0, 1.44 / 12.0, 0, 0, 0, 4.0 * NAV_PI * NAV_PI / 12.0};
    assert_near(g.mean.x, 1.5, 1e-12);
    assert_near(g.mean.y, 0.6, 1e-12);
    for (int i = 0; i < 9; i++)
        assert_near(g.covariance[i], variances[i], 1e-12);
}

/* Against a Gaussian that is moved row by row: an early error in heading leads the later rows astray. */
static void a_motion_put_off_is_as_good_as_done(void **state)
{
    (void)state;
    struct nav_gaussian late = {.mean = {1.0, 2.0, 1.0}, .covariance = {0.01, 0, 0, 0, 0.04, 0, 0, 0, 0.09}};
    struct nav_gaussian now = late;
    struct nav_pending pending = {.step = {0.0, 0.0, 0.0}};
    for (int n = 0; n < 30; n++) {
        const struct nav_pose step = {0.3, 0.05, 0.02 * (n % 7)};
        const struct nav_noise noise = {0.001, 0.002};
        nav_pending_add(&pending, step, noise);
        nav_gaussian_move(&now, step, &noise);
    }
    nav_gaussian_move(&late, pending.step, &pending.noise);
    assert_near(late.mean.x, now.mean.x, 1e-12);
    assert_near(late.mean.y, now.mean.y, 1e-12);
    assert_near(late.mean.theta, now.mean.theta, 1e-12);
    assert_near(late.covariance[0] + late.covariance[4], now.covariance[0] + now.covariance[4], 1e-9);
    assert_near(late.covariance[8], now.covariance[8], 1e-12);
}

static void a_circle_walked_in_steps_closes(void **state)
{
    (void)state;
    struct nav_gaussian g = {.mean = {1.0, 1.0, 3.0}, .covariance = {1, 0, 0, 0, 1, 0, 0, 0, 0.01}};
    for (int i = 0; i < 360; i++)
        nav_gaussian_move(&g, (struct nav_pose){0.01, 0.0, NAV_PI / 180.0}, &NO_NOISE);
    assert_near(g.mean.x, 1.0, 1e-9);
    assert_near(g.mean.theta, 3.0, 1e-9);
    assert_near(g.covariance[0], 1.0, 1e-9); /* heading error does not move where one started */
}

static void an_inverse_undoes_and_a_flat_covariance_has_none(void **state)
{
    (void)state;
    const double c[9] = {2.0, 0.3, 0.1, 0.3, 1.0, -0.2, 0.1, -0.2, 0.5};
    double inverse[9];
    assert_true(nav_gaussian_invert(c, inverse));
    for (int i = 0; i < 9; i++) {
        double sum = 0.0;
        for (int k = 0; k < 3; k++)
            sum += c[i / 3 * 3 + k] * inverse[3 * k + i % 3];
        assert_near(sum, i % 4 == 0 ? 1.0 : 0.0, 1e-12);
    }
    const double flat[9] = {1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    assert_false(nav_gaussian_invert(flat, inverse));
    const double broken[9] = {NAN, 0, 0, 0, 1, 0, 0, 0, 1};
    assert_false(nav_gaussian_invert(broken, inverse));
}

static void mass_near_the_mean_is_the_normal_distributions(void **state)
{
    (void)state;
    struct nav_gaussian g = {.covariance = {0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.0625}};
    double round = (1.0 - exp(-0.5 * 6.25)) * erf(2.0 / sqrt(2.0));
    assert_near(nav_gaussian_mass(&g, 0.25, 0.5), round, 1e-9);
    g.covariance[4] = 1e-12; /* a line: one dimension is left */
    assert_near(nav_gaussian_mass(&g, 0.25, 10.0), erf(2.5 / sqrt(2.0)), 0.02);
}

static void a_sum_has_the_moments_of_the_mixture(void **state)
{
    (void)state;
    /* Masses 1 and 3 at x = 0 and 4 m, at headings on both sides of half a turn. */
    struct nav_gaussian a = {.mean = {0.0, 1.0, NAV_PI - 0.1}, .covariance = {0.5, 0.1, 0, 0.1, 0.2, 0, 0, 0, 0.01}};
    struct nav_gaussian b = {.mean = {4.0, 1.0, -NAV_PI + 0.1}, .covariance = {0.9, 0.1, 0, 0.1, 0.2, 0, 0, 0, 0.01}};
    struct nav_gaussian_sum sum = {.about = b.mean};
    nav_gaussian_sum_add(&sum, 1.0, &a);
    nav_gaussian_sum_add(&sum, 3.0, &b);
    struct nav_gaussian g = nav_gaussian_sum_moments(&sum);
    assert_near(g.mean.x, 3.0, 1e-12);
    assert_near(g.mean.y, 1.0, 1e-12);
    assert_near(nav_wrap(g.mean.theta - (NAV_PI + 0.05)), 0.0, 1e-12);
    assert_near(g.covariance[0], 0.8 + 3.0, 1e-12); /* mean of the variances, variance of the means */
    assert_near(g.covariance[1], 0.1, 1e-12);
    assert_near(g.covariance[2], 0.75 * 1.0 * 0.05 - 0.25 * 3.0 * -0.15, 1e-12);
    assert_near(g.covariance[8], 0.01 + 0.25 * 0.75 * 0.04, 1e-12);
}

static void noise_grows_with_the_way_not_with_the_number_of_rows(void **state)
{
    (void)state;
    struct nav_problem p = room();
    const struct nav_motion whole = {.step = {0.3, 0.0, 0.2}}, part = {.step = {0.03, 0.0, 0.02}};
    struct nav_noise once = nav_motion_noise(&p.robot, &p.settings, &whole);
    struct nav_noise tenth = nav_motion_noise(&p.robot, &p.settings, &part);
    assert_near(10.0 * tenth.position, once.position, 1e-12);
    assert_near(10.0 * tenth.heading, once.heading, 1e-12);
    assert_near(once.position, pow(0.05 * 0.3, 2.0), 1e-12); /* one correlation length: the paper's 5 % of the way */
    const struct nav_motion unknown = {.unknown_m = 0.1, .unknown_rad = 0.2};
    assert_near(nav_motion_noise(&p.robot, &p.settings, &unknown).position, 0.01, 1e-12);
    assert_near(nav_motion_noise(&p.robot, &p.settings, &unknown).heading, 0.04, 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_step_is_taken_in_the_frame_it_starts_in),
        cmocka_unit_test(moving_turns_heading_error_into_sideways_error),
        cmocka_unit_test(moving_carries_what_is_known_of_position_and_heading_together),
        cmocka_unit_test(a_robot_that_may_be_anywhere_is_in_the_middle_give_or_take_the_arena),
        cmocka_unit_test(a_motion_put_off_is_as_good_as_done),
        cmocka_unit_test(a_circle_walked_in_steps_closes),
        cmocka_unit_test(an_inverse_undoes_and_a_flat_covariance_has_none),
        cmocka_unit_test(mass_near_the_mean_is_the_normal_distributions),
        cmocka_unit_test(a_sum_has_the_moments_of_the_mixture),
        cmocka_unit_test(noise_grows_with_the_way_not_with_the_number_of_rows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
