/* The Kalman filter where it must equal one worked out by hand, and what it makes of textures; its state is looked at,
 * so its source is part of this program. */
#include "../filter/kalman.c"

#include "near.h"
#include "rooms.h"

static const double NOTHING_READ[] = {0.0, 0.0}, RAY_READ[] = {0.0, 1.0}, TIP_READ[] = {1.0, 0.0};

/* Facing the right wall square on from (0.7, 0.6): the whisker's base is 0.25 m from it, 0.05 m more than its length.
 */
static struct nav_problem facing_wall(void)
{
    struct nav_problem p = room();
    p.prior.mean = (struct nav_pose){0.8, 0.6, 0.0};
    p.prior.sigma[0] = 0.03;
    p.prior.sigma[1] = 0.04;
    p.prior.sigma[2] = 1e-5; /* the heading is known: the range is linear in x */
    return p;
}

static void read_distance(struct nav_kalman *k, double distance)
{
    const double *reading[] = {NULL, &distance};
    kalman_update(k, &(struct nav_evidence){.reading = reading, .weight = RAY_READ});
}

/* One window that says texture `is` with certainty. */
static void read_texture(struct nav_kalman *k, int is)
{
    const double loglik[] = {is == 0 ? 0.0 : -50.0, is == 1 ? 0.0 : -50.0};
    const double *reading[] = {loglik, NULL};
    kalman_update(k, &(struct nav_evidence){.reading = reading, .weight = TIP_READ});
}

static void drive(struct nav_kalman *k, double metres)
{
    kalman_predict(k, &(struct nav_motion){.step = {metres, 0.0, 0.0}});
}

/* Expected 0.15, read 0.14: the gain is 0.03^2 / (0.03^2 + 0.005^2), towards the wall. */
static void assert_contact_is_a_kalman_update(const struct nav_kalman *k)
{
    double prior = 0.0009, noise = 0.000025, gain = prior / (prior + noise);
    assert_near(k->belief.mean.x, 0.8 + gain * 0.01, 1e-6);
    assert_near(k->belief.mean.y, 0.6, 1e-6);
    assert_near(k->belief.covariance[0], prior * (1.0 - gain), 1e-8);
    assert_near(k->belief.covariance[4], 0.0016, 1e-7);
}

/* Before the border between the lower tiles at x = 0.5, heading for it, with an odometry that makes no errors. */
static struct nav_problem behind_the_border(void)
{
    struct nav_problem p = room();
    p.prior.mean = (struct nav_pose){0.3, 0.25, 0.0};
    p.prior.sigma[0] = p.prior.sigma[1] = 0.05;
    p.prior.sigma[2] = 1e-5;
    p.robot.odometry_relative = 0.0;
    p.settings.motion.drift_rad = 0.0;
    return p;
}

/* Drives eight steps; the tip reads tile 0 for four of them, then tile 1: it crossed between steps 4 and 5. */
static void cross(struct nav_kalman *k)
{
    for (int i = 1; i <= 8; i++) {
        drive(k, 0.02);
        read_texture(k, i > 4);
    }
}

static void a_contact_square_on_is_a_kalman_update(void **state)
{
    (void)state;
    struct nav_problem p = facing_wall();
    struct nav_kalman *k = kalman_create_extended(&p);
    read_distance(k, 0.14);
    assert_contact_is_a_kalman_update(k);
    assert_int_equal(k->evaluations, 7); /* the mean and two per axis */
    kalman_destroy(k);
}

static void a_slanted_wall_turns_heading_into_range(void **state)
{
    (void)state;
    struct nav_problem p = facing_wall();
    p.prior.mean.theta = NAV_PI / 6.0;
    struct nav_kalman *k = kalman_create_extended(&p);
    struct nav_kalman_linear l;
    const struct nav_kalman_sighting s = {.ray = 0, .reach = 1.0};
    kalman_linearise(k, &s, &l);
    /* Range (1 - x) / cos(a) - 0.05: its slope is -1 / cos(a) in x, and (1 - x) sin(a) / cos(a)^2 in the heading. */
    double c = sqrt(0.75);
    assert_near(l.expected, 0.2 / c - 0.05, 1e-9);
    assert_near(l.cross[0], 0.0009 * -1.0 / c, 1e-8);
    assert_near(l.cross[2], 1e-10 * 0.2 * 0.5 / 0.75, 1e-16);
    assert_near(l.variance, 0.0009 / 0.75, 1e-8);
    kalman_destroy(k);
}

static void a_corner_has_no_derivative_and_changes_nothing(void **state)
{
    (void)state;
    struct nav_problem p = facing_wall();
    p.prior.mean = (struct nav_pose){0.68, 0.3, 0.0}; /* the whisker grazes the upper edge of the box */
    struct nav_kalman *k = kalman_create_extended(&p);
    read_distance(k, 0.1);
    assert_near(k->belief.mean.x, 0.68, 0.0);
    assert_near(k->belief.covariance[0], 0.0009, 0.0);
    kalman_destroy(k);
}

static void what_is_too_far_off_is_not_believed(void **state)
{
    (void)state;
    struct nav_problem p = facing_wall();
    p.prior.sigma[0] = 0.005;
    struct nav_kalman *k = kalman_create_extended(&p);
    read_distance(k, 0.10); /* 0.05 m off at 0.007 m */
    assert_near(k->belief.mean.x, 0.8, 0.0);
    assert_near(k->belief.covariance[0], 0.000025, 0.0);
    kalman_destroy(k);
}

static void no_contact_pushes_out_of_reach_and_no_further(void **state)
{
    (void)state;
    struct nav_problem p = facing_wall();
    struct nav_kalman *k = kalman_create_extended(&p);
    read_distance(k, INFINITY); /* the wall is expected 0.15 m along a whisker of 0.2 m: at least 0.2 */
    double noise = 0.005 * 0.005 + p.settings.radial.edge_m * p.settings.radial.edge_m;
    assert_near(k->belief.mean.x, 0.8 - 0.05 * 0.0009 / (0.0009 + noise), 1e-6);
    struct nav_gaussian before = k->belief;
    k->belief.mean.x = before.mean.x = 0.6; /* nothing within reach: nothing learned */
    read_distance(k, INFINITY);
    assert_memory_equal(&before, &k->belief, sizeof before);
    kalman_destroy(k);
}

static void a_border_crossed_puts_the_tip_on_the_line(void **state)
{
    (void)state;
    struct nav_problem p = behind_the_border();
    struct nav_kalman *k = kalman_create_extended(&p);
    cross(k);
    /* At steps 4 and 5 the mean had the tip at 0.48 and 0.50, between them 0.49; the border is at 0.5. Its place is
     * known to hypot(0.01, 0.01). Since then the robot has driven 0.07 m, which moves the line along with the tip. */
    double gain = 0.0025 / (0.0025 + 0.0002);
    assert_near(k->belief.mean.x, 0.3 + 8 * 0.02 + gain * 0.01, 1e-6);
    assert_near(k->belief.covariance[0], 0.0025 * (1.0 - gain), 1e-8);
    assert_near(k->belief.covariance[4], 0.0025, 1e-8);
    kalman_destroy(k);
}

/* Aslant towards the corner of four tiles: a border lies 0.01 m ahead, one of the same two textures 0.1 m to the left.
 * A belief that is surer of the place than the crossing takes the near one. */
static void of_two_borders_that_were_it_the_likelier_is_taken(void **state)
{
    (void)state;
    const double c = sqrt(0.5), way = 0.09 + 0.1; /* the tip's, half way between steps 4 and 5 */
    struct nav_problem p = behind_the_border();
    p.prior.mean = (struct nav_pose){0.49 - way * c, 0.40 - way * c, NAV_PI / 4.0};
    p.prior.sigma[0] = p.prior.sigma[1] = 0.005;
    struct nav_kalman *k = kalman_create_extended(&p);
    cross(k);
    /* The crossing's place is known to hypot(0.01, 0.01) along the way, which meets the border at 45 degrees. */
    double prior = 0.000025, gain = prior / (prior + 0.0001);
    assert_near(k->belief.mean.x, p.prior.mean.x + 0.16 * c + gain * 0.01, 1e-6);
    assert_near(k->belief.mean.y, p.prior.mean.y + 0.16 * c, 1e-6);
    kalman_destroy(k);
}

/* A surface once sure, a window that speaks for two others: it is the likelier that the whisker crossed into. */
static void of_two_textures_that_were_it_the_likelier_is_taken(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_borders b;
    struct nav_crossing crossing;
    p.arena.classes = 3;
    const float before[] = {0.0f, -20.0f, -20.0f}, after[][3] = {{-20.0f, -14.0f, -10.0f}, {-20.0f, -10.0f, -14.0f}};
    for (int n = 0; n < 2; n++) {
        assert_int_equal(nav_borders_init(&b, &p.arena, &p.robot), 0);
        assert_false(nav_borders_read(&b, 0, before, &crossing));
        assert_true(nav_borders_read(&b, 0, after[n], &crossing));
        assert_int_equal(crossing.from, 0);
        assert_int_equal(crossing.to, 2 - n);
        nav_borders_free(&b);
    }
}

static void a_texture_without_a_border_says_nothing(void **state)
{
    (void)state;
    struct nav_problem p = behind_the_border();
    struct nav_kalman *k = kalman_create_extended(&p);
    for (int i = 0; i < 4; i++)
        read_texture(k, 1); /* the belief's own tile is 0: no information */
    assert_near(k->belief.mean.x, 0.3, 0.0);
    assert_near(k->belief.covariance[0], 0.0025, 1e-15);
    kalman_destroy(k);
}

static void a_first_window_that_was_wrong_is_no_border(void **state)
{
    (void)state;
    struct nav_problem p = behind_the_border();
    struct nav_kalman *k = kalman_create_extended(&p);
    for (int i = 1; i <= 8; i++) {
        drive(k, 0.02);
        read_texture(k, i > 1); /* one window of tile 0, then the surface that it has been on all the time */
    }
    assert_near(k->belief.mean.x, 0.3 + 8 * 0.02, 1e-12);
    assert_near(k->belief.covariance[0], 0.0025, 1e-12);
    kalman_destroy(k);
}

static void nothing_read_changes_nothing(void **state)
{
    (void)state;
    struct nav_problem p = facing_wall();
    struct nav_kalman *k = kalman_create_extended(&p);
    struct nav_gaussian before = k->belief;
    kalman_update(k, &(struct nav_evidence){.reading = NULL, .weight = NOTHING_READ});
    assert_memory_equal(&before, &k->belief, sizeof before);
    assert_int_equal(k->evaluations, 0);
    kalman_destroy(k);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_contact_square_on_is_a_kalman_update),
        cmocka_unit_test(a_slanted_wall_turns_heading_into_range),
        cmocka_unit_test(a_corner_has_no_derivative_and_changes_nothing),
        cmocka_unit_test(what_is_too_far_off_is_not_believed),
        cmocka_unit_test(no_contact_pushes_out_of_reach_and_no_further),
        cmocka_unit_test(a_border_crossed_puts_the_tip_on_the_line),
        cmocka_unit_test(of_two_borders_that_were_it_the_likelier_is_taken),
        cmocka_unit_test(of_two_textures_that_were_it_the_likelier_is_taken),
        cmocka_unit_test(a_texture_without_a_border_says_nothing),
        cmocka_unit_test(a_first_window_that_was_wrong_is_no_border),
        cmocka_unit_test(nothing_read_changes_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
