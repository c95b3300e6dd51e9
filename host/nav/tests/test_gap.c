/* Rows that never came: their motion is taken to be like their neighbours', unless it has been counted. */
#include "gap.h"

#include "near.h"

static const struct nav_pose STRAIGHT = {0.02, 0.0, 0.0}, TURN = {0.0, 0.0, 0.2};

/* Gaps of a robot that drove straight on in rows 0.1 s apart until 1 s. */
static struct nav_gaps driven(void)
{
    struct nav_gaps g;
    nav_gaps_init(&g);
    for (int k = 1; k <= 10; k++) {
        double from = 0.1 * (k - 1), until = 0.1 * k;
        int missing = nav_gaps_missing(&g, from, until);
        assert_int_equal(missing, 0);
        nav_gaps_bridge(&g, &STRAIGHT, missing, from, until);
    }
    return g;
}

static struct nav_motion after(struct nav_gaps *g, struct nav_pose step, double until_s)
{
    return nav_gaps_bridge(g, &step, nav_gaps_missing(g, 1.0, until_s), 1.0, until_s);
}

static void a_missing_row_was_like_those_around_it(void **state)
{
    (void)state;
    struct nav_gaps g = driven();
    struct nav_motion m = after(&g, STRAIGHT, 1.2);
    assert_near(m.step.x, 0.04, 0.0025);
    assert_true(m.unknown_m > 0.0 && m.unknown_m < 0.005);
    g = driven();
    m = after(&g, TURN, 1.2);
    assert_true(m.unknown_m > 0.009 && m.unknown_rad > 0.09); /* it may have done either */
}

static void after_a_long_gap_nothing_is_assumed(void **state)
{
    (void)state;
    struct nav_gaps g = driven();
    struct nav_motion m = after(&g, STRAIGHT, 4.0);
    assert_near(m.step.x, 0.02, 1e-12);
    assert_true(m.unknown_m > 0.2);
    assert_int_equal(nav_gaps_missing(&g, 4.0, 1e9), 100);
}

static void a_row_that_covers_the_missing_ones_is_believed(void **state)
{
    (void)state;
    struct nav_gaps g = driven();
    struct nav_motion m = after(&g, (struct nav_pose){0.06, 0.0, 0.0}, 1.3);
    assert_near(m.step.x, 0.06, 1e-12);
    assert_near(m.unknown_m, 0.0, 0.0);
}

static void what_comes_late_replaces_what_was_assumed(void **state)
{
    (void)state;
    struct nav_gaps g = driven();
    struct nav_motion first = after(&g, STRAIGHT, 1.2);
    struct nav_motion late = nav_gaps_fill(&g, STRAIGHT, 1.1);
    assert_near(first.step.x + late.step.x, 0.04, 1e-12);
    assert_near(nav_gaps_fill(&g, STRAIGHT, 0.5).step.x, 0.02, 0.0); /* nothing was missing there */
}

static void a_slower_robot_misses_no_rows(void **state)
{
    (void)state;
    struct nav_gaps g;
    nav_gaps_init(&g);
    int missing = 0;
    for (int k = 0; k < 30; k++)
        missing = nav_gaps_missing(&g, 0.3 * k, 0.3 * k + 0.3);
    assert_int_equal(missing, 0);
}

static void unreadable_odometry_leaves_as_much_unknown_as_usual(void **state)
{
    (void)state;
    struct nav_gaps g = driven();
    struct nav_motion m = nav_gaps_bridge(&g, NULL, 1, 1.0, 1.2);
    assert_near(m.step.x, 0.0, 0.0);
    assert_near(m.unknown_m, 2.0 * g.usual_m, 1e-12);
    assert_true(g.usual_m > 0.005);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_missing_row_was_like_those_around_it),
        cmocka_unit_test(after_a_long_gap_nothing_is_assumed),
        cmocka_unit_test(a_row_that_covers_the_missing_ones_is_believed),
        cmocka_unit_test(what_comes_late_replaces_what_was_assumed),
        cmocka_unit_test(a_slower_robot_misses_no_rows),
        cmocka_unit_test(unreadable_odometry_leaves_as_much_unknown_as_usual),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
