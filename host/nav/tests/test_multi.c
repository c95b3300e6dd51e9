/* Several Gaussians: fits, splits, merges by hand, and a robot tracked. */
#include "multi.h"

#include "near.h"
#include "wander.h"

static void points_give_their_mean_and_covariance(void **state)
{
    (void)state;
    const double offset[] = {1.0, 0.0, 0.0, -1.0, 2.0, 0.2}, weight[] = {0.25, 0.75};
    const struct multi_points points = {offset, weight, 2};
    struct nav_gaussian g = multi_fit((struct nav_pose){10.0, 20.0, 0.0}, &points);
    assert_near(g.mean.x, 9.5, 1e-12);
    assert_near(g.mean.y, 21.5, 1e-12);
    assert_near(g.mean.theta, 0.15, 1e-12);
    assert_near(g.covariance[0], 0.75, 1e-12);  /* 0.25 x 1.5^2 + 0.75 x 0.5^2 */
    assert_near(g.covariance[1], -0.75, 1e-12); /* 0.25 x 1.5 x -1.5 + 0.75 x -0.5 x 0.5 */
}

static void two_heaps_split_and_one_does_not(void **state)
{
    (void)state;
    enum { POINTS = 100 };
    double offset[3 * POINTS] = {0.0}, weight[POINTS], half[POINTS], sum = 0.0;
    struct nav_rng rng;
    nav_rng_seed(&rng, 1, 0);
    for (int n = 0; n < POINTS; n++) {
        weight[n] = 1.0 / POINTS;
        offset[3 * n] = 0.01 * nav_rng_normal(&rng);
        offset[3 * n + 1] = 0.05 * nav_rng_normal(&rng);
    }
    const struct multi_points points = {offset, weight, POINTS};
    assert_false(multi_split(&points, 0.75, half));
    for (int n = 0; n < POINTS; n++)
        offset[3 * n + 1] += n % 4 ? 0.3 : -0.3;
    assert_true(multi_split(&points, 0.75, half));
    for (int n = 0; n < POINTS; n++)
        sum += half[n];
    assert_true(fabs(sum - 0.25) < 1e-9 || fabs(sum - 0.75) < 1e-9);
}

/* Two heaps 1 m apart along any line in the plane, or 3 rad apart in heading. */
static void heaps_are_told_apart_along_any_direction(void **state)
{
    (void)state;
    enum { POINTS = 100, LINES = 12 };
    double offset[3 * POINTS], weight[POINTS], half[POINTS];
    struct nav_rng rng;
    nav_rng_seed(&rng, 2, 0);
    const struct multi_points points = {offset, weight, POINTS};
    for (int line = 0; line <= LINES; line++) {
        double angle = NAV_PI * line / LINES;
        const double apart[3] = {cos(angle), sin(angle), 0.0}, turned[3] = {0.0, 0.0, 3.0};
        for (int n = 0; n < POINTS; n++) {
            weight[n] = 1.0 / POINTS;
            for (int i = 0; i < 3; i++)
                offset[3 * n + i] =
                    0.02 * nav_rng_normal(&rng) + (n % 4 ? 0.5 : -0.5) * (line < LINES ? apart : turned)[i];
        }
        assert_true(multi_split(&points, 0.75, half));
        for (int n = 0; n < POINTS; n++)
            assert_int_equal(half[n] > 0.0, (half[0] > 0.0) == (n % 4 == 0));
    }
}

static void merged_modes_keep_their_moments(void **state)
{
    (void)state;
    struct multi_mode mode[3] = {
        {.belief = {.mean = {0.0, 0.0, 3.1}, .covariance = {1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0}}, .weight = 0.6},
        {.belief = {.mean = {0.4, 0.0, -3.1}, .covariance = {1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0}}, .weight = 0.3},
        {.belief = {.mean = {9.0, 0.0, 0.0}, .covariance = {1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0}}, .weight = 0.1},
    };
    struct multi_modes modes = {mode, 3, 3};
    multi_merge(&modes, 0.5);
    assert_int_equal(modes.count, 2);
    assert_near(mode[0].weight, 0.9, 1e-12);
    assert_near(mode[0].belief.mean.x, 0.4 / 3.0, 1e-12);
    assert_near(mode[0].belief.covariance[0], 1.0 + 0.16 * 2.0 / 9.0, 1e-12);
    assert_near(fabs(mode[0].belief.mean.theta), 3.1 + (NAV_PI - 3.1) * 2.0 / 3.0, 1e-9);
    multi_prune(&modes, 0.2);
    assert_int_equal(modes.count, 1);
    assert_near(mode[0].weight, 1.0, 1e-12);
}

static void all_modes_merged_weigh_no_more_than_one(void **state)
{
    (void)state;
    const struct nav_gaussian there = {.covariance = {1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0}};
    struct multi_mode mode[3] = {{there, 0.55}, {there, 0.34}, {there, 0.11}}; /* in doubles: 1 + 2^-52 */
    struct multi_modes modes = {mode, 3, 3};
    multi_merge(&modes, 0.5);
    assert_int_equal(modes.count, 1);
    assert_true(mode[0].weight <= 1.0 && mode[0].weight > 1.0 - 1e-12);
}

static void a_robot_is_tracked(void **state)
{
    (void)state;
    struct wander w = wander_new(3);
    struct nav_filter *f = nav_filter_new("multi", &w.problem);
    struct nav_estimate e;
    for (int k = 0; k < 200; k++) {
        nav_filter_step(f, wander_on(&w), &e);
        assert_true(e.states <= (long)w.problem.settings.multi.modes);
    }
    assert_true(wander_error(&w, &e) < 0.1 && e.confidence > 0.5);
    nav_filter_free(f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_give_their_mean_and_covariance),    cmocka_unit_test(two_heaps_split_and_one_does_not),
        cmocka_unit_test(heaps_are_told_apart_along_any_direction), cmocka_unit_test(merged_modes_keep_their_moments),
        cmocka_unit_test(all_modes_merged_weigh_no_more_than_one),  cmocka_unit_test(a_robot_is_tracked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
