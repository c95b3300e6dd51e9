/* Odometry: its noise. */
#include "motion.h"
#include "near.h"
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_does_not_depend_on_how_rows_cut_a_drive),
        cmocka_unit_test(a_gyroscope_takes_the_place_of_the_wheels_for_turns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
