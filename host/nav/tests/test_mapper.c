/* The mapper on hand-made rows: a joint Gaussian against a closed form, a wall met twice, and rows that nobody can use.
 */
#include "mapper.h"

#include <math.h>

#include "joint.h"
#include "near.h"
#include "particle_map.h"
#include "rooms.h"
#include "segment.h"
#include "wall.h"

static void test_a_measurement_corrects_what_is_correlated(void **state)
{
    (void)state;
    double mean[NAV_JOINT_FACES], cov[NAV_JOINT_FACES * NAV_JOINT_FACES];
    struct nav_joint j = {.room = NAV_JOINT_FACES, .mean = mean, .cov = cov};
    struct nav_linear x = {.terms = 0}, y = {.terms = 0};
    for (int n = 0; n < NAV_JOINT_FACES * NAV_JOINT_FACES; n++)
        cov[n] = 7.0; /* memory that was used before */
    nav_joint_begin(&j, 0.0, 0.0);
    nav_joint_move(&j, (struct nav_pose){0.0, 0.0, 0.0}, (struct nav_noise){0.0, 0.01});
    nav_joint_move(&j, (struct nav_pose){2.0, 0.0, 0.0}, (struct nav_noise){0.0, 0.0});
    nav_linear_add(&x, NAV_JOINT_X, 1.0);
    nav_linear_add(&y, NAV_JOINT_Y, 1.0);
    assert_near(nav_joint_variance(&j, &x), 0.0, 1e-12);
    assert_near(nav_joint_variance(&j, &y), 0.04, 1e-12); /* 2 m times 0.1 rad, squared */
    nav_joint_measure(&j, &y, 0.2, 0.04);
    assert_near(mean[NAV_JOINT_Y], 0.1, 1e-12);
    assert_near(mean[NAV_JOINT_HEADING], 0.05, 1e-12);
    assert_near(nav_joint_variance(&j, &y), 0.02, 1e-12);
    assert_near(cov[NAV_JOINT_HEADING * (NAV_JOINT_FACES + 1)], 0.005, 1e-12);
}

/* Of a whisker that points ahead and reports no normal. */
static struct nav_touch touch(double x, double y, double variance)
{
    return (struct nav_touch){.x = x, .y = y, .along_x = 1.0, .variance = variance, .normal = NAN};
}

static void test_contacts_in_a_row_make_a_line(void **state)
{
    (void)state;
    struct nav_touches t = {.held = 0};
    struct nav_touches_line line;
    int last = 0;
    for (int n = 0; n < 6; n++)
        last = nav_touches_keep(&t, touch(0.3, 0.05 * n, 1e-6));
    (void)nav_touches_keep(&t, touch(0.2, 0.1, 1e-6));
    assert_true(nav_touches_fit(&t, last, t.held, &line));
    assert_int_equal(nav_touches_count(line.used), 6);
    assert_near(fabs(nav_wrap(line.normal)), NAV_PI, 1e-9);
    assert_near(line.x, 0.3, 1e-9);
    assert_near(line.span, 0.25, 1e-9);
    assert_false(nav_touches_fit(&t, last, line.used & ~7ULL, &line));
}

/* The line's first guess goes through two of the contacts; least squares turns it towards the others. */
static void test_a_line_through_contacts_that_scatter_is_the_one_of_least_squares(void **state)
{
    (void)state;
    struct nav_touches t = {.held = 0};
    struct nav_touches_line line;
    const double off[] = {0.002, -0.002, 0.0, 0.001, -0.001, 0.002};
    double slope = 0.0, squares = 0.0;
    int last = 0;
    for (int n = 0; n < 6; n++) {
        double y = 0.05 * n - 0.125;
        last = nav_touches_keep(&t, touch(0.3 + 0.1 * y + off[n], y, 4e-6));
        slope += y * (0.1 * y + off[n]);
        squares += y * y;
    }
    assert_true(nav_touches_fit(&t, last, t.held, &line));
    assert_int_equal(nav_touches_count(line.used), 6);
    assert_near(nav_wrap(line.normal - NAV_PI), -atan(slope / squares), 1e-4);
}

static void test_a_contact_and_its_normal_make_a_line(void **state)
{
    (void)state;
    struct nav_touches t = {.held = 0};
    struct nav_touches_line line;
    struct nav_touch reported = touch(0.0, 0.1, 1e-6);
    reported.normal = 3.0;
    reported.normal_var = 0.06 * 0.06;
    int at = nav_touches_keep(&t, reported);
    assert_true(nav_touches_fit(&t, at, t.held, &line));
    assert_true(line.used == 1ULL << at);
    assert_near(line.normal, 3.0, 0.0);
    assert_near(line.y, 0.1, 0.0);
    assert_near(line.span, 0.0, 0.0);
    nav_touches_move(&t, (struct nav_pose){0.0, 0.0, 0.1}, (struct nav_noise){0.0, 0.01});
    assert_near(t.touch[at].normal, 2.9, 1e-12);
    assert_true(nav_touches_fit(&t, at, t.held, &line));
    assert_near(line.normal_var, 0.06 * 0.06 + 0.01, 1e-12);
    nav_touches_move(&t, (struct nav_pose){0.0, 0.0, 0.0}, (struct nav_noise){0.0, 0.01});
    assert_false(nav_touches_fit(&t, at, t.held, &line)); /* turned too far since */
    at = nav_touches_keep(&t, touch(0.3, 0.1, 1e-6));
    assert_false(nav_touches_fit(&t, at, t.held, &line));
}

/* One contact with what stands `x` m ahead, `y` m to the left, of a whisker that reports the face's normal. */
static void feel(struct nav_particle_map *map, double x, double y, double normal)
{
    struct nav_touch reported = touch(x, y, 25e-6);
    reported.normal = normal;
    reported.normal_var = 0.05 * 0.05;
    struct nav_contact contact = {nav_touches_keep(&map->touches, reported), 0.005, 0.2, 0.01};
    (void)nav_faces_take(&map->faces, &map->joint, &map->touches, &contact);
    (void)nav_segment_take(&map->faces, &map->joint, &map->touches, &contact);
}

static void test_one_contact_and_its_normal_begin_a_face(void **state)
{
    (void)state;
    struct nav_particle_map map;
    assert_int_equal(nav_particle_map_init(&map, 1), 0);
    feel(&map, 0.3, 0.0, NAN);
    assert_int_equal(map.faces.count, 0);
    feel(&map, 0.3, 0.1, NAV_PI);
    assert_int_equal(map.faces.count, 1);
    nav_joint_set(&map.joint, NAV_JOINT_X, 0.03, 0.05 * 0.05);
    feel(&map, 0.3, -0.1, NAV_PI); /* the same wall, felt again: the pose was 3 cm too far ahead */
    assert_int_equal(map.faces.count, 1);
    assert_near(map.joint.mean[NAV_JOINT_X], 0.0, 0.002);
    nav_joint_set(&map.joint, NAV_JOINT_X, 0.03, 0.05 * 0.05);
    feel(&map, 0.3, -0.1, -NAV_PI / 2.0); /* a wall beside it, at right angles */
    assert_int_equal(map.faces.count, 2);
    assert_near(map.joint.mean[NAV_JOINT_X], 0.03, 0.002);
    nav_particle_map_free(&map);
}

static void step(void *mapper, const struct nav_row *row, struct nav_estimate *out)
{
    nav_mapper_step(mapper, row, out);
}

static struct drive drive_begin(const struct nav_problem *p)
{
    struct nav_mapper_options options = nav_mapper_default();
    return (struct drive){.step = step, .mapper = nav_mapper_new(p, &options), .pose = {0.2, 0.0, 0.0}};
}

static void test_a_wall_felt_again_corrects_the_pose(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_mapper_face face[8];
    struct drive d = drive_begin(&p);
    drive_bout(&d, 1.0);
    assert_int_equal(nav_mapper_faces(d.mapper, face, 8), 1);
    assert_near(face[0].x0, 0.8, 0.01); /* the first pose, at 0.2 m, is the origin */
    assert_near(face[0].x1, 0.8, 0.01);
    assert_near(fabs(face[0].normal), NAV_PI, 0.1);
    for (int bout = 0; bout < 3; bout++)
        drive_bout(&d, 1.05); /* 3 cm a bout, 9 cm in all, by the wheels */
    for (int n = 0; n < 30; n++)
        drive_step(&d, 0.02, 0.0, 1.0);
    assert_near(d.estimate.pose.x, d.pose.x - 0.2, 0.01);
    nav_mapper_free(d.mapper);
}

static void test_without_contacts_it_is_never_surer(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct drive d = drive_begin(&p);
    double before = 0.0;
    d.pose.theta = NAV_PI; /* away from the wall */
    for (int n = 0; n < 600; n++) {
        drive_step(&d, 0.02, 0.0, 1.0);
        double now = d.estimate.covariance[0] + d.estimate.covariance[4];
        assert_true(now >= before);
        before = now;
    }
    assert_true(d.estimate.confidence < 0.5);
    assert_int_equal(nav_mapper_faces(d.mapper, NULL, 0), 0);
    nav_mapper_free(d.mapper);
}

static void test_bad_cells_are_counted_and_not_read(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct drive d = drive_begin(&p);
    double texture[2] = {INFINITY, NAN}, radial = -1.0;
    struct nav_row row = {.t_s = 0.1, .odometry = {NAN, 0.0, 1e9}, .texture = texture, .radial_m = &radial};
    for (int n = 0; n < 100; n++) {
        row.t_s += 0.1;
        nav_mapper_step(d.mapper, &row, &d.estimate);
        assert_true(isfinite(d.estimate.pose.x + d.estimate.pose.y + d.estimate.pose.theta));
    }
    assert_int_equal(nav_mapper_bad_cells(d.mapper), 100 * 5);
    row.t_s = 5.0;
    nav_mapper_step(d.mapper, &row, &d.estimate);
    assert_int_equal(nav_mapper_bad_rows(d.mapper), 1);
    assert_int_equal(nav_mapper_faces(d.mapper, NULL, 0), 0);
    nav_mapper_free(d.mapper);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_measurement_corrects_what_is_correlated),
        cmocka_unit_test(test_contacts_in_a_row_make_a_line),
        cmocka_unit_test(test_a_line_through_contacts_that_scatter_is_the_one_of_least_squares),
        cmocka_unit_test(test_a_contact_and_its_normal_make_a_line),
        cmocka_unit_test(test_one_contact_and_its_normal_begin_a_face),
        cmocka_unit_test(test_a_wall_felt_again_corrects_the_pose),
        cmocka_unit_test(test_without_contacts_it_is_never_surer),
        cmocka_unit_test(test_bad_cells_are_counted_and_not_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
