/* Ways over small grounds, their time and floor worked out by hand; what is closed, the budget, no allocation. */
#include "count_allocations.h"
#include "coverage.h"
#include "near.h"

enum { SIDE = 20, MIDDLE = 10 };
static const double CELL = 0.1, ASIDE[] = {-0.1, 0.0, 0.1}, QUARTER = 1.5707963267948966;

static float open_[SIDE * SIDE];
static uint8_t fresh[SIDE * SIDE];

/* 2 m x 2 m, all open, nothing fresh. */
static struct nav_coverage_ground ground(void)
{
    for (int k = 0; k < SIDE * SIDE; k++) {
        open_[k] = 1.0F;
        fresh[k] = 0;
    }
    return (struct nav_coverage_ground){SIDE, SIDE, 0.0, 0.0, CELL, open_, fresh};
}

static void column(uint8_t *cells, int at, int from, int until)
{
    for (int row = from; row < until; row++)
        cells[row * SIDE + at] = 1;
}

/* 1 m/s and a quarter turn in 1 s. */
static struct nav_coverage_options options(void)
{
    return (struct nav_coverage_options){.drive_m_s = 1.0,
                                         .turn_rad_s = QUARTER,
                                         .begin_s = 0.5,
                                         .stopped_s = 10.0,
                                         .least_m2 = 0.01,
                                         .asides = 3,
                                         .aside = ASIDE};
}

static struct nav_coverage_plan plan_of(const struct nav_coverage_options *o, struct nav_coverage_ground g, double x,
                                        double y, double turn)
{
    struct nav_coverage_plan out;
    struct nav_coverage *c = nav_coverage_new(SIDE * SIDE, o);
    assert_non_null(c);
    nav_coverage_plan(c, &g, x, y, turn, &out);
    nav_coverage_free(c);
    return out;
}

/* Two cells beside each other, three ahead: each step of the last three sweeps two. */
static void a_way_straight_on(void **state)
{
    (void)state;
    struct nav_coverage_ground g = ground();
    struct nav_coverage_options o = options();
    for (int n = 12; n < 15; n++)
        fresh[MIDDLE * SIDE + n] = fresh[(MIDDLE + 1) * SIDE + n] = 1;
    struct nav_coverage_plan out = plan_of(&o, g, 1.05, 1.05, 0.0);
    assert_int_equal(out.corners, 1);
    assert_near(out.x[0], 1.45, 1e-9);
    assert_near(out.y[0], 1.05, 1e-9);
    assert_near(out.swept_m2, 0.06, 1e-6);
    assert_near(out.seconds, 0.4, 1e-6);
    assert_near(out.passed, 1.0, 0.0);
}

/* Fresh floor in a line to the left: the turn, and on beyond what lies behind it. */
static void a_turn_costs_its_time(void **state)
{
    (void)state;
    struct nav_coverage_ground g = ground();
    struct nav_coverage_options o = options();
    column(fresh, MIDDLE, 12, SIDE);
    struct nav_coverage_plan out = plan_of(&o, g, 1.05, 1.05, 0.0);
    assert_int_equal(out.corners, 1);
    assert_near(out.x[0], 1.05, 1e-9);
    assert_near(out.y[0], 1.95, 1e-9);
    assert_near(out.swept_m2, 0.08, 1e-6);
    assert_near(out.seconds, 0.5 + 1.0 + 0.9, 1e-5);
}

/* A wall with a gap between it and the only fresh floor. */
static void corners_lead_round_a_wall(void **state)
{
    (void)state;
    struct nav_coverage_ground g = ground();
    struct nav_coverage_options o = options();
    for (int row = 0; row < SIDE - 2; row++)
        open_[row * SIDE + MIDDLE] = 0.0F;
    column(fresh, SIDE - 1, 0, 4);
    struct nav_coverage_plan out = plan_of(&o, g, 0.55, 0.25, 0.0);
    assert_true(out.corners >= 3);
    double highest = 0.0, x = 0.55, y = 0.25;
    for (int n = 0; n < out.corners; n++) {
        double way_x = fabs(out.x[n] - x), way_y = fabs(out.y[n] - y);
        assert_true(fmin(way_x, way_y) < 1e-9 || fabs(way_x - way_y) < 1e-9);
        x = out.x[n];
        y = out.y[n];
        highest = fmax(highest, y);
    }
    assert_true(highest > 1.8);
    assert_near(out.swept_m2, 0.04, 1e-6);
    for (int row = SIDE - 2; row < SIDE; row++)
        open_[row * SIDE + MIDDLE] = 0.0F;
    assert_int_equal(plan_of(&o, g, 0.55, 0.25, 0.0).corners, 0);
}

/* What may stop the robot counts half, and costs half of a stop; what is behind it counts half, too. */
static void what_may_be_closed_counts_less(void **state)
{
    (void)state;
    struct nav_coverage_ground g = ground();
    struct nav_coverage_options o = options();
    column(fresh, MIDDLE, 12, 15);
    open_[11 * SIDE + MIDDLE] = 0.5F;
    for (int row = 0; row < SIDE; row++)
        open_[row * SIDE + MIDDLE - 1] = open_[row * SIDE + MIDDLE + 1] = 0.0F;
    struct nav_coverage_plan out = plan_of(&o, g, 1.05, 1.05, QUARTER);
    assert_near(out.swept_m2, 0.015, 1e-6);
    assert_near(out.seconds, 0.4 + 0.5 * 10.0, 1e-5);
    assert_near(out.passed, 0.5, 1e-6);
    o.least_m2 = 0.02;
    assert_int_equal(plan_of(&o, g, 1.05, 1.05, QUARTER).corners, 0);
}

static void of_two_the_better_a_second_is_taken(void **state)
{
    (void)state;
    struct nav_coverage_ground g = ground();
    struct nav_coverage_options o = options();
    column(fresh, MIDDLE + 1, MIDDLE - 1, MIDDLE + 2);
    column(fresh, MIDDLE - 5, 0, SIDE);
    assert_near(plan_of(&o, g, 1.05, 1.05, 0.0).x[0], 1.15, 1e-9);
    o.least_m2 = 0.04;
    struct nav_coverage_plan out = plan_of(&o, g, 1.05, 1.05, 0.0);
    assert_true(out.corners > 0 && out.x[out.corners - 1] < 0.8);
}

static void a_pose_off_the_ground_has_no_way(void **state)
{
    (void)state;
    struct nav_coverage_ground g = ground();
    struct nav_coverage_options o = options();
    column(fresh, MIDDLE, 0, SIDE);
    assert_int_equal(plan_of(&o, g, 2.05, 1.0, 0.0).corners, 0);
    assert_int_equal(plan_of(&o, g, (double)NAN, 1.0, 0.0).corners, 0);
    assert_int_equal(plan_of(&o, g, 1.0, 1.0, (double)NAN).corners, 0);
    g.rows = SIDE + 1;
    assert_int_equal(plan_of(&o, g, 1.0, 1.0, 0.0).corners, 0);
    o.drive_m_s = 0.0;
    assert_null(nav_coverage_new(SIDE * SIDE, &o));
    o.drive_m_s = 1.0;
    assert_null(nav_coverage_new(0, &o));
}

static void the_budget_is_kept(void **state)
{
    (void)state;
    struct nav_coverage_ground g = ground();
    struct nav_coverage_options o = options();
    column(fresh, MIDDLE, 12, SIDE);
    long all = plan_of(&o, g, 1.05, 1.05, 0.0).spent;
    assert_int_equal(all, 8 * SIDE * SIDE);
    for (o.budget = 1; o.budget < all; o.budget *= 2)
        assert_int_equal(plan_of(&o, g, 1.05, 1.05, 0.0).spent, o.budget);
    o.budget = 8;
    assert_int_equal(plan_of(&o, g, 1.05, 1.05, 0.0).corners, 0);
}

static void a_plan_allocates_nothing(void **state)
{
    (void)state;
    struct nav_coverage_ground g = ground();
    struct nav_coverage_options o = options();
    struct nav_coverage_plan out;
    column(fresh, MIDDLE, 12, SIDE);
    struct nav_coverage *c = nav_coverage_new(SIDE * SIDE, &o);
    allocations = 0;
    nav_coverage_plan(c, &g, 1.05, 1.05, 0.0, &out);
    assert_int_equal(allocations, 0);
    assert_int_equal(out.corners, 1);
    nav_coverage_free(c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_way_straight_on),
        cmocka_unit_test(a_turn_costs_its_time),
        cmocka_unit_test(corners_lead_round_a_wall),
        cmocka_unit_test(what_may_be_closed_counts_less),
        cmocka_unit_test(of_two_the_better_a_second_is_taken),
        cmocka_unit_test(a_pose_off_the_ground_has_no_way),
        cmocka_unit_test(the_budget_is_kept),
        cmocka_unit_test(a_plan_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
