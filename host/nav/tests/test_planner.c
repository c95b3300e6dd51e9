/* Plans on ground of two textures, their gains worked out by hand; what was read or met, the budget, no allocation. */
#include "count_allocations.h"
#include "information.h"
#include "near.h"
#include "planner.h"

enum { SIDE = 40, PLANNER_TEST_STEPS = 10 };
static const double CELL = 0.1, TEXTURE_NATS = 0.5, TOUCH_NATS = 1.0;

static uint8_t texture[SIDE * SIDE];
static float clear_m[SIDE * SIDE];
static const struct nav_tip TIP = {0.0, 0.0};
static const struct nav_ray RAY = {0.1, 0.0, 0.0, 0.2};
static const double HERE_AND_THERE[] = {1.05, 2.05, 0.0, 1.05, 1.05, 0.0};
static const struct nav_planner_past NO_PAST = {.met = 0};

/* 4 m x 4 m: class 1 where y > 1.5 m and x > 1.5 m, else 0; solid beyond x = 3.5 m. */
static struct nav_planner_ground ground(void)
{
    for (int row = 0; row < SIDE; row++) {
        for (int column = 0; column < SIDE; column++) {
            texture[row * SIDE + column] = row >= 15 && column >= 15;
            clear_m[row * SIDE + column] = (float)fmax(0.0, (35 - column) * CELL - CELL / 2.0);
        }
    }
    return (struct nav_planner_ground){SIDE, SIDE, 0.0, 0.0, CELL, texture, clear_m};
}

static struct nav_planner_options options(void)
{
    return (struct nav_planner_options){
        .contact_s = 1.0, .stop_nats = 2.0, .place_m = 0.25, .place_rad = 0.5, .clear_m = 0.2, .floor_bits = 0.1};
}

/* Ahead, to the left and backwards, in steps of 0.1 m and 1 s, ends everywhere. */
static struct nav_planner *planner(const struct nav_planner_options *o, const struct nav_robot *robot)
{
    static struct nav_planner_step step[3][PLANNER_TEST_STEPS];
    static const double TURN[] = {0.0, 1.5707963267948966, 3.141592653589793};
    struct nav_planner_path path[3];
    struct nav_planner_ground g = ground();
    for (int k = 0; k < 3; k++) {
        for (int n = 0; n < PLANNER_TEST_STEPS; n++) {
            double way = 0.1 * (n + 1);
            step[k][n] = (struct nav_planner_step){.x = way * cos(TURN[k]),
                                                   .y = way * sin(TURN[k]),
                                                   .turn = TURN[k],
                                                   .seconds = 1.0,
                                                   .texture_nats = TEXTURE_NATS,
                                                   .touch_nats = TOUCH_NATS,
                                                   .ends = true};
        }
        path[k] = (struct nav_planner_path){PLANNER_TEST_STEPS, step[k]};
    }
    return nav_planner_new(&g, robot, path, 3, o);
}

static struct nav_planner_plan plan_of(const struct nav_planner_options *o, const struct nav_robot *robot,
                                       const double *poses, int n, const struct nav_planner_past *past)
{
    struct nav_planner_plan out;
    struct nav_planner *p = planner(o, robot);
    assert_non_null(p);
    nav_planner_plan(p, poses, n, -1, past, &out);
    nav_planner_free(p);
    return out;
}

static const struct nav_robot SWEEPS = {.body_radius = 0.1, .tips = 1, .tip = &TIP};
static const struct nav_robot FEELS = {.body_radius = 0.05, .rays = 1, .ray = &RAY};

/* After k steps on different floors the two are k / 2 nats apart: 1 - log2(1 + exp(-k / 2)) bits in 4 + k s. The first
 * different floor is met with the fifth step, and k = 6 of ten steps yields most per second. */
static void the_gain_is_what_is_worked_out_by_hand(void **state)
{
    (void)state;
    struct nav_planner_options o = options();
    struct nav_planner_plan out = plan_of(&o, &SWEEPS, HERE_AND_THERE, 2, &NO_PAST);
    int best = 1;
    double rate = 0.0;
    for (int k = 1; k <= 6; k++) {
        double bits = 1.0 - log2(1.0 + exp(-TEXTURE_NATS * k));
        if (bits / (4.0 + k) > rate) {
            rate = bits / (4.0 + k);
            best = k;
        }
    }
    assert_int_equal(out.path, 0);
    assert_int_equal(out.steps, 4 + best);
    assert_near(out.bits, 1.0 - log2(1.0 + exp(-TEXTURE_NATS * best)), 1e-6);
    assert_near(out.seconds, 4.0 + best, 1e-9);
    assert_near(out.passed, 1.0, 0.0);
}

static void what_differs_within_a_place_is_no_gain(void **state)
{
    (void)state;
    static const double near[] = {1.05, 1.55, 0.0, 1.05, 1.45, 0.0};
    struct nav_planner_options o = options();
    assert_int_equal(plan_of(&o, &SWEEPS, near, 2, &NO_PAST).path, -1);
}

static void a_place_that_was_read_and_a_way_that_is_closed_are_no_choice(void **state)
{
    (void)state;
    double been[3 * PLANNER_TEST_STEPS];
    static const double ahead[] = {0.25, 0.0}, around[] = {0.15, 0.0, 0.0, 0.15, -0.15, 0.0};
    for (int n = 0; n < PLANNER_TEST_STEPS; n++) {
        been[3 * n] = 0.1 * (n + 1);
        been[3 * n + 1] = been[3 * n + 2] = 0.0;
    }
    struct nav_planner_options o = options();
    struct nav_planner_past read = {.been = PLANNER_TEST_STEPS, .pose = been}, met = {.met = 1, .thing = ahead};
    struct nav_planner_past shut = {.met = 3, .thing = around};
    assert_int_not_equal(plan_of(&o, &SWEEPS, HERE_AND_THERE, 2, &read).path, 0);
    assert_int_not_equal(plan_of(&o, &SWEEPS, HERE_AND_THERE, 2, &met).path, 0);
    assert_false(plan_of(&o, &SWEEPS, HERE_AND_THERE, 2, &met).shut_in);
    assert_true(plan_of(&o, &SWEEPS, HERE_AND_THERE, 2, &shut).shut_in);
}

/* One stands 0.5 m before the wall, the other 2 m. The whisker of the first touches at the second step, which ends its
 * path and costs a second: 1 nat apart by the touch, and 2 more if it is the other that goes on. */
static void a_touch_is_felt_where_it_is(void **state)
{
    (void)state;
    static const double poses[] = {3.0, 2.0, 0.0, 1.5, 2.0, 0.0};
    struct nav_planner_options o = options();
    o.touch_stops = true;
    struct nav_planner_plan out = plan_of(&o, &FEELS, poses, 2, &NO_PAST);
    assert_int_equal(out.path, 0);
    assert_int_equal(out.steps, 2);
    assert_near(out.passed, 0.5, 0.0);
    assert_near(out.bits, 1.0 - 0.5 * (log2(1.0 + exp(-1.0)) + log2(1.0 + exp(-3.0))), 1e-6);
    assert_near(out.seconds, 2.5, 1e-9);
}

static void a_known_pose_has_nothing_to_gain(void **state)
{
    (void)state;
    struct nav_planner_options o = options();
    assert_int_equal(plan_of(&o, &SWEEPS, HERE_AND_THERE, 1, &NO_PAST).path, -1);
    assert_int_equal(plan_of(&o, &SWEEPS, HERE_AND_THERE, 0, &NO_PAST).path, -1);
}

/* Every reading of two hypotheses costs 4 pairs, every end 4 more. */
static void the_budget_is_kept(void **state)
{
    (void)state;
    struct nav_planner_options o = options();
    long all = plan_of(&o, &SWEEPS, HERE_AND_THERE, 2, &NO_PAST).spent;
    assert_true(all > 0);
    for (o.budget = 4; o.budget < all; o.budget += 4) {
        struct nav_planner_plan out = plan_of(&o, &SWEEPS, HERE_AND_THERE, 2, &NO_PAST);
        assert_true(out.spent >= o.budget && out.spent < o.budget + 8);
    }
    o.budget = 0;
    o.after = 2;
    assert_true(plan_of(&o, &SWEEPS, HERE_AND_THERE, 2, &NO_PAST).spent > all);
}

static void a_plan_allocates_nothing(void **state)
{
    (void)state;
    struct nav_planner_options o = options();
    struct nav_planner_plan out;
    o.after = 3;
    allocations = 0;
    struct nav_planner *p = planner(&o, &SWEEPS);
    assert_true(p && allocations > 0);
    allocations = 0;
    nav_planner_plan(p, HERE_AND_THERE, 2, -1, &NO_PAST, &out);
    nav_planner_touch(p, HERE_AND_THERE, 2, -1, 3.0);
    assert_int_equal(allocations, 0);
    nav_planner_free(p);
}

static void distances_add_up_to_their_limit(void **state)
{
    (void)state;
    uint8_t apart[4] = {0}, codes[] = {10, 13};
    assert_false(nav_information_differ(apart, 2, 2, (uint8_t[]){7, 7}, 0, 8));
    nav_information_differ(apart, 2, 2, codes, 3, 8);
    assert_int_equal(apart[1], 0);
    for (int k = 0; k < 40; k++)
        nav_information_differ(apart, 2, 2, codes, 2, 8);
    assert_int_equal(apart[1], 255);
    assert_int_equal(apart[0], 0);
    nav_information_differ(apart, 2, 2, (uint8_t[]){10, NAV_INFORMATION_NOTHING}, 0, 8);
    assert_int_equal(apart[2], 255);
    uint8_t fresh[4] = {0}, stopped[] = {0, 1};
    assert_true(nav_information_refute(fresh, 2, 2, stopped, 16));
    assert_int_equal(fresh[1], 16); /* the one that goes on */
    assert_int_equal(fresh[2], 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_gain_is_what_is_worked_out_by_hand),
        cmocka_unit_test(what_differs_within_a_place_is_no_gain),
        cmocka_unit_test(a_place_that_was_read_and_a_way_that_is_closed_are_no_choice),
        cmocka_unit_test(a_touch_is_felt_where_it_is),
        cmocka_unit_test(a_known_pose_has_nothing_to_gain),
        cmocka_unit_test(the_budget_is_kept),
        cmocka_unit_test(a_plan_allocates_nothing),
        cmocka_unit_test(distances_add_up_to_their_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
