/* Arcs and covariances computed by hand. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "create/motion.h"

#define NEAR 1e-9
#define PI 3.14159265358979323846
#define R 0.05 /* relative error */

enum { X, Y, THETA };

static void assert_near(double value, double expected)
{
    if (!(fabs(value - expected) <= NEAR)) {
        fail_msg("%.12g, expected %.12g", value, expected);
    }
}

static void assert_pose(const struct create_motion *motion, double x, double y, double theta)
{
    assert_near(motion->x, x);
    assert_near(motion->y, y);
    assert_near(motion->theta, theta);
}

/* Adds an arc in equal steps, each with its share of errors that are the same in every step. */
static void add_arc(struct create_motion *motion, double distance, double angle, int steps)
{
    const struct create_step step = {
        .distance = distance / steps,
        .angle = angle / steps,
        .scale_distance = fabs(distance) / steps * R,
        .scale_angle = fabs(angle) / steps * R,
    };
    for (int i = 0; i < steps; i++) {
        create_motion_add(motion, &step);
    }
}

static void a_quarter_circle_ends_beside_its_centre(void **state)
{
    (void)state;
    struct create_motion left = {0}, right = {0};
    add_arc(&left, PI / 2, PI / 2, 1);
    assert_pose(&left, 1, 1, PI / 2);
    add_arc(&right, -PI / 2, PI / 2, 90); /* backwards */
    assert_pose(&right, -1, -1, PI / 2);
}

static void many_steps_make_the_same_arc_as_one(void **state)
{
    (void)state;
    struct create_motion one = {0}, many = {0};
    add_arc(&one, 0.7, -1.3, 1);
    add_arc(&many, 0.7, -1.3, 5000); /* angles so small that the series serves */
    assert_pose(&many, one.x, one.y, one.theta);
}

static void a_square_closes(void **state)
{
    (void)state;
    struct create_motion motion = {0};
    for (int side = 0; side < 4; side++) {
        add_arc(&motion, 1, 0, 3);
        add_arc(&motion, 0, PI / 2, 5);
    }
    assert_pose(&motion, 0, 0, 2 * PI);
}

/* With distance d, angle a: x = d/a sin a, y = d/a (1 - cos a). At d = a = pi/2 the derivatives by d, times d, are 1
 * and 1; those by a are -2/pi and 1 - 2/pi. */
static void assert_quarter_covariance(int steps)
{
    struct create_motion motion = {0};
    double c[3][3];
    add_arc(&motion, PI / 2, PI / 2, steps);
    create_motion_covariance(&motion, c);
    const double s = R * PI / 2, xa = -2 / PI * s, ya = (1 - 2 / PI) * s;
    assert_near(c[X][X], R * R + xa * xa);
    assert_near(c[X][Y], R * R + xa * ya);
    assert_near(c[Y][Y], R * R + ya * ya);
    assert_near(c[X][THETA], xa * s);
    assert_near(c[Y][THETA], ya * s);
    assert_near(c[THETA][THETA], s * s);
    assert_near(c[THETA][X], c[X][THETA]);
}

static void scale_errors_add_up_linearly(void **state)
{
    (void)state;
    assert_quarter_covariance(1);
    assert_quarter_covariance(200);
}

/* A heading that drifts evenly by R over a metre leaves the line by R / 2. */
static void drift_bends_a_straight_line(void **state)
{
    (void)state;
    struct create_motion motion = {0};
    double c[3][3];
    for (int i = 0; i < 10; i++) {
        create_motion_add(&motion, &(struct create_step){.distance = 0.1, .scale_drift = 0.1 * R});
    }
    create_motion_covariance(&motion, c);
    assert_near(c[THETA][THETA], R * R);
    assert_near(c[Y][Y], R * R / 4);
    assert_near(c[Y][THETA], R * R / 2);
    assert_near(c[X][X], 0);
}

/* Two steps of 1 m, the heading of each unsure by 0.1: the first error acts over 0.5 + 1 m, the second over 0.5 m. */
static void loose_errors_add_up_as_variance(void **state)
{
    (void)state;
    struct create_motion motion = {0};
    double c[3][3];
    const struct create_step step = {.distance = 1, .loose_angle = 0.1, .loose_distance = 0.2};
    create_motion_add(&motion, &step);
    create_motion_add(&motion, &step);
    create_motion_covariance(&motion, c);
    assert_near(c[THETA][THETA], 0.02);
    assert_near(c[Y][Y], 0.01 * (1.5 * 1.5 + 0.5 * 0.5));
    assert_near(c[Y][THETA], 0.01 * (1.5 + 0.5));
    assert_near(c[X][X], 0.08);
}

/* A counter of whole units has a remainder at the beginning and at the end, not at every step between. */
static void what_counters_owe_does_not_grow(void **state)
{
    (void)state;
    struct create_motion motion = {0};
    double c[3][3];
    for (int i = 0; i < 100; i++) {
        create_motion_add(&motion,
                          &(struct create_step){.distance = 0.02, .grain_distance = 0.001, .grain_angle = 0.06});
    }
    create_motion_covariance(&motion, c);
    assert_near(c[X][X], 2 * 0.001 * 0.001 / 12);
    assert_near(c[THETA][THETA], 2 * 0.06 * 0.06 / 12);
    assert_near(c[Y][Y], 2.0 * 2.0 * 0.06 * 0.06 / 12); /* 2 m from where the angle was unsure */
    assert_near(c[Y][THETA], 2.0 * 0.06 * 0.06 / 12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_quarter_circle_ends_beside_its_centre),
        cmocka_unit_test(many_steps_make_the_same_arc_as_one),
        cmocka_unit_test(a_square_closes),
        cmocka_unit_test(scale_errors_add_up_linearly),
        cmocka_unit_test(drift_bends_a_straight_line),
        cmocka_unit_test(loose_errors_add_up_as_variance),
        cmocka_unit_test(what_counters_owe_does_not_grow),
    };
    return cmocka_run_group_tests_name("motion", tests, NULL, NULL);
}
