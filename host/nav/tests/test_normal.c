#include "likelihood.h"
#include "near.h"
#include "rooms.h"

static struct nav_problem with_normals(void)
{
    struct nav_problem p = room();
    p.robot.normals = true;
    return p;
}

enum { NORMAL = 2 }; /* texture whisker, distance, normal */

/* Middle of the expected code in degrees, robot's frame; NAN: not known. */
static double expected(const struct nav_problem *p, struct nav_pose at)
{
    struct nav_likelihood *l = nav_likelihood_new(&p->arena, &p->robot, &p->settings, 0.0);
    uint8_t codes[3];
    nav_likelihood_expect(l, &(struct nav_place){at.x, at.y, cos(at.theta), sin(at.theta)}, codes);
    double all = l->model[NORMAL].codes - 1;
    double degrees = codes[NORMAL] < all ? nav_wrap((codes[NORMAL] + 0.5) / all * 2.0 * NAV_PI) * 180.0 / NAV_PI : NAN;
    nav_likelihood_free(l);
    return degrees;
}

static void a_face_is_expected_by_its_normal_in_the_robots_frame(void **state)
{
    (void)state;
    struct nav_problem p = with_normals();
    /* The left side of the box, seen from its left; the same, looked at aslant. */
    assert_near(fabs(expected(&p, (struct nav_pose){0.62, 0.15, 0.0})), 180.0, 1.01);
    assert_near(expected(&p, (struct nav_pose){0.62, 0.15, 0.3}), 180.0 - 0.3 * 180.0 / NAV_PI, 1.01);
    /* Its upper side, and the upper wall. */
    assert_near(fabs(expected(&p, (struct nav_pose){0.9, 0.5, -NAV_PI / 2.0})), 180.0, 1.01);
    assert_near(expected(&p, (struct nav_pose){0.4, 0.82, 1.0}), -90.0 - 180.0 / NAV_PI, 1.01);
}

static void where_there_is_no_single_face_it_is_not_known(void **state)
{
    (void)state;
    struct nav_problem p = with_normals();
    assert_true(isnan(expected(&p, (struct nav_pose){0.4, 0.5, 0.0})));    /* nothing within reach */
    assert_true(isnan(expected(&p, (struct nav_pose){0.62, 0.297, 0.0}))); /* 3 mm from the box's corner */
    assert_true(isfinite(expected(&p, (struct nav_pose){0.62, 0.29, 0.0})));
    assert_true(isnan(expected(&p, (struct nav_pose){0.82, 0.303, 0.0}))); /* wall and box */
    p.arena.unknown = 1;
    assert_true(isnan(expected(&p, (struct nav_pose){0.62, 0.15, 0.0}))); /* never mapped */
}

static void a_direction_is_a_wrapped_gaussian_on_a_floor_of_outliers(void **state)
{
    (void)state;
    struct nav_problem p = with_normals();
    p.settings.normal.outlier = 0.1;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    struct nav_model *m = &l->model[NORMAL];
    double ratio[NAV_CODES_MOST], sum = 0.0;
    const double reading[] = {NAV_PI, 0.1}, peak = sqrt(2.0 * NAV_PI) / 0.1;
    m->kind->fill(m, reading, ratio);
    /* Codes 89 and 90 lie one degree to either side. */
    assert_near(ratio[89], 0.9 * peak * exp(-0.5 * 0.03046174) + 0.1, 1e-4);
    assert_near(ratio[90], ratio[89], 1e-9);
    assert_near(ratio[0], 0.1, 1e-9);
    assert_near(ratio[m->codes - 1], 1.0, 0.0);
    for (int k = 0; k < m->codes - 1; k++)
        sum += ratio[k] / (m->codes - 1);
    assert_near(sum, 1.0, 1e-6); /* of all directions a face has, none is favoured by chance */
    nav_likelihood_free(l);
}

static void bad_directions_are_counted_and_not_read(void **state)
{
    (void)state;
    struct nav_problem p = with_normals();
    struct nav_filter *f = nav_filter_new("particle", &p);
    const double texture[] = {NAN, NAN}, nothing = NAN;
    const double bad[][2] = {{INFINITY, 0.1}, {7.0, 0.1}, {1.0, NAN}, {1.0, 0.0}, {1.0, -0.1}, {1.0, 4.0}};
    struct nav_estimate e;
    struct nav_row row = {.texture = texture, .radial_m = &nothing};
    for (int n = 0; n < 6; n++) {
        row.t_s = 0.1 * (n + 1);
        row.normal = bad[n];
        nav_filter_step(f, &row, &e);
        assert_int_equal(nav_filter_bad_cells(f), n + 1);
        assert_int_equal(e.evaluations, 0);
    }
    const double none[] = {NAN, 0.1};
    const double *unread[] = {none, NULL};
    for (int n = 0; n < 2; n++) {
        row.t_s = 0.1 * (n + 7);
        row.normal = unread[n];
        nav_filter_step(f, &row, &e);
        assert_int_equal(nav_filter_bad_cells(f), 6);
    }
    nav_filter_free(f);
}

/* Spread of the heading after a face was met straight ahead, reported with or without its direction. */
static double heading_spread(const char *filter, bool reported)
{
    struct nav_problem p = with_normals();
    p.settings.normal.outlier = 0.05;
    p.prior.mean = (struct nav_pose){0.56, 0.15, 0.0};
    p.prior.sigma[0] = p.prior.sigma[1] = 0.02;
    p.prior.sigma[2] = 0.3;
    struct nav_filter *f = nav_filter_new(filter, &p);
    const double texture[] = {NAN, NAN}, distance = 0.19, normal[] = {NAV_PI, 0.05};
    struct nav_row row = {.t_s = 0.1, .texture = texture, .radial_m = &distance, .normal = reported ? normal : NULL};
    struct nav_estimate e;
    nav_filter_step(f, &row, &e);
    nav_filter_free(f);
    return sqrt(e.covariance[8]);
}

static void filters_learn_their_heading_from_it(void **state)
{
    (void)state;
    static const char *const FILTERS[] = {"grid", "particle", "adaptive", "foveal", "ekf"};
    for (size_t n = 0; n < sizeof FILTERS / sizeof *FILTERS; n++) {
        double without = heading_spread(FILTERS[n], false), with = heading_spread(FILTERS[n], true);
        if (!(with < 0.6 * without))
            fail_msg("%s: %g rad with the direction, %g without", FILTERS[n], with, without);
    }
}

static void a_robot_that_reports_none_is_as_it_was(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    assert_int_equal(l->whiskers, 2);
    nav_likelihood_free(l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_face_is_expected_by_its_normal_in_the_robots_frame),
        cmocka_unit_test(where_there_is_no_single_face_it_is_not_known),
        cmocka_unit_test(a_direction_is_a_wrapped_gaussian_on_a_floor_of_outliers),
        cmocka_unit_test(bad_directions_are_counted_and_not_read),
        cmocka_unit_test(filters_learn_their_heading_from_it),
        cmocka_unit_test(a_robot_that_reports_none_is_as_it_was),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
