/* Odometry: its noise, and its constant errors learned. */
#include "calibration.h"
#include "near.h"
#include "rng.h"
#include "rooms.h"

static void noise_does_not_depend_on_how_rows_cut_a_drive(void **state)
{
    (void)state;
    struct nav_problem p = room();
    const struct nav_motion whole = {.step = {0.1, 0.0, 0.2}}, part = {.step = {0.02, 0.0, 0.04}};
    struct nav_noise once = nav_motion_noise(&p.robot, &p.settings, &whole);
    struct nav_noise fifth = nav_motion_noise(&p.robot, &p.settings, &part);
    assert_near(5.0 * fifth.position, once.position, 1e-12);
    assert_near(5.0 * fifth.heading, once.heading, 1e-12);
}

static void a_gyroscope_takes_the_place_of_the_wheels_for_turns(void **state)
{
    (void)state;
    struct nav_problem p = room();
    const struct nav_motion turn = {.step = {0.1, 0.0, 0.2}};
    double position = nav_motion_noise(&p.robot, &p.settings, &turn).position;
    p.robot.odometry_turn = 0.004;
    assert_near(nav_motion_noise(&p.robot, &p.settings, &turn).position, position, 1e-15);
    assert_near(nav_motion_noise(&p.robot, &p.settings, &turn).heading, 0.004 * 0.004, 1e-15);
    const struct nav_motion stand = {.step = {0.0, 0.0, 0.0}};
    assert_near(nav_motion_noise(&p.robot, &p.settings, &stand).heading, 0.004 * 0.004, 1e-15);
}

/* Drives and turns; the wheels report `reported` times the truth; the filter sees the truth within `spread`. */
static struct nav_calibration drive(double reported, double reported_turn, double spread, double confidence, int rows)
{
    struct nav_calibration c;
    struct nav_rng rng;
    struct nav_pose truth = {1.0, 1.0, 0.0};
    nav_calibration_init(&c);
    nav_rng_seed(&rng, 5, 0);
    for (int i = 0; i < rows; i++) {
        struct nav_pose step = i % 40 < 25 ? (struct nav_pose){0.02, 0.0, 0.0} : (struct nav_pose){0.0, 0.0, 0.1};
        struct nav_motion motion = {.step = {step.x * reported, 0.0, step.theta * reported_turn}};
        motion = nav_calibration_apply(&c, &motion);
        truth = nav_compose(truth, step);
        struct nav_estimate e = {.pose = truth, .confidence = confidence};
        e.pose.x += spread * nav_rng_normal(&rng);
        e.pose.y += spread * nav_rng_normal(&rng);
        e.pose.theta = nav_wrap(truth.theta + spread * nav_rng_normal(&rng));
        e.covariance[0] = e.covariance[4] = e.covariance[8] = spread * spread;
        nav_calibration_learn(&c, &motion, &e);
    }
    return c;
}

static void a_constant_scale_and_turn_are_learned(void **state)
{
    (void)state;
    struct nav_calibration c = drive(0.85, 1.2, 0.01, 1.0, 2000);
    assert_near(c.distance.value, 1.0 / 0.85, 0.02);
    assert_near(c.turn.value, 1.0 / 1.2, 0.02);
    c = drive(1.0, 1.0, 0.01, 1.0, 2000);
    assert_near(c.distance.value, 1.0, 0.025);
    assert_near(c.turn.value, 1.0, 0.02);
}

static void an_unsure_filter_teaches_nothing(void **state)
{
    (void)state;
    struct nav_calibration c = drive(0.85, 1.2, 0.01, 0.5, 2000);
    assert_near(c.distance.value, 1.0, 0.0);
    assert_near(c.turn.value, 1.0, 0.0);
}

static void what_is_learned_is_bounded(void **state)
{
    (void)state;
    struct nav_calibration c = drive(0.67, 0.67, 0.001, 1.0, 8000);
    assert_near(c.distance.value, 1.3, 1e-12);
    assert_near(c.turn.value, 1.3, 1e-12);
}

static void a_jump_is_not_the_wheels_fault(void **state)
{
    (void)state;
    struct nav_calibration c;
    nav_calibration_init(&c);
    const struct nav_motion step = {.step = {0.4, 0.0, 0.0}};
    struct nav_estimate e = {.pose = {0.5, 0.5, 0.0}, .confidence = 1.0};
    nav_calibration_learn(&c, &step, &e);
    e.pose.x = 2.5;
    nav_calibration_learn(&c, &step, &e);
    assert_near(c.distance.value, 1.0, 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_does_not_depend_on_how_rows_cut_a_drive),
        cmocka_unit_test(a_gyroscope_takes_the_place_of_the_wheels_for_turns),
        cmocka_unit_test(a_constant_scale_and_turn_are_learned),
        cmocka_unit_test(an_unsure_filter_teaches_nothing),
        cmocka_unit_test(what_is_learned_is_bounded),
        cmocka_unit_test(a_jump_is_not_the_wheels_fault),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
