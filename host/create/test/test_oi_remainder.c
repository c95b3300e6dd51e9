/* Bases that keep or drop what is less than a unit: which one it is, and what counts before that is known. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "odometry_base.h"

/* The trap: what a Create 1 reports of the whisk when it drops remainders. */
static void the_reported_whisk_is_no_turn_where_remainders_are_dropped(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_REPORTED, false);
    base_whisk(&base, 3);
    assert_true(base.motion.theta == 0);
}

static void auto_sees_the_whisk_before_it_knows_the_firmware(void **state)
{
    (void)state;
    for (int keeps = 0; keeps < 2; keeps++) {
        struct base base = base_begin(CREATE_1, CREATE_AUTO, keeps);
        base_whisk(&base, 0.6);
        assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
        assert_int_equal(base.odometry.angle, CREATE_REQUESTED);
        assert_close(base.motion.theta, 0.6 * WHISK_RAD_S, 1e-9);
    }
}

static void a_straight_drive_reports_that_remainders_are_kept(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_AUTO, true);
    base_drive(&base, 100, 100, 3, 0.96); /* wheels that slip by 4 % */
    assert_int_equal(base.odometry.remainder, CREATE_KEPT);
    base.motion = (struct create_motion){0};
    base_whisk(&base, 3);
    assert_int_equal(base.odometry.angle, CREATE_REPORTED);
    assert_close(base.motion.theta, 3 * WHISK_RAD_S, DEGREE);
}

static void a_straight_drive_reports_that_remainders_are_dropped(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_AUTO, false);
    base_drive(&base, 100, 100, 3, 0.96);
    assert_int_equal(base.odometry.remainder, CREATE_DROPPED);
    base.motion = (struct create_motion){0};
    base_drive(&base, 100, 100, 3, 1);
    assert_int_equal(base.odometry.distance, CREATE_REQUESTED);
    assert_close(base.motion.x, 0.3, 1e-9); /* reported as 0.2 */
    base_whisk(&base, 3);
    assert_close(base.motion.theta, 3 * WHISK_RAD_S, 1e-9);
}

/* 7.5 and 3.6 mm per frame: too near whole units to tell; backwards it works as well. */
static void only_a_speed_that_separates_them_is_evidence(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_AUTO, false);
    base_drive(&base, 500, 500, 3, 1);
    base_drive(&base, 200, 200, 3, 1); /* 3 mm exactly */
    assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
    base_drive(&base, -100, -100, 2, 1);
    assert_int_equal(base.odometry.remainder, CREATE_DROPPED);
    base.keeps = true; /* another base was plugged in */
    base_drive(&base, -100, -100, 2, 1);
    assert_int_equal(base.odometry.remainder, CREATE_KEPT);
}

/* Zeros are what a body reports that stands: only whole units in a turn are evidence, and these against dropping. */
static void slow_turns_report_that_remainders_are_kept_and_never_that_they_are_dropped(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_AUTO, true);
    base_drive(&base, -TURN_MM_S, TURN_MM_S, 1, 0.95);
    assert_int_equal(base.odometry.remainder, CREATE_KEPT);
    base = base_begin(CREATE_1, CREATE_AUTO, false);
    base_drive(&base, -TURN_MM_S, TURN_MM_S, 60, 0.95);
    base_drive(&base, -30, -30, 60, 1);
    assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
    assert_int_equal(base.odometry.standing, CREATE_CANNOT_TELL);
}

/* Spans of 0.3 s at the exploration's speed, a wall every other time: none alone decides. */
static void evidence_outlasts_interruptions(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_AUTO, false);
    for (int i = 0; i < 40; i++) {
        base_drive(&base, 150, 150, 0.3, 1);
        base_drive(&base, 0, 0, 0.3, 1);
        base_drive(&base, -150, -150, 0.3, 0);
    }
    assert_int_equal(base.odometry.remainder, CREATE_DROPPED);
}

/* The bytes of a frame that was damaged in a way its sum does not show, now and then. */
static void stray_numbers_are_not_believed(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_AUTO, false);
    for (int i = 0; i < 50; i++) {
        base_drive(&base, -TURN_MM_S, TURN_MM_S, 3, 1);
        base.degrees += 1;
    }
    assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
}

/* 5 mm a frame were asked for, and somebody makes 6 of them, steadily: more than the wheels' error. */
static void a_push_is_no_evidence_that_remainders_are_kept(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_AUTO, false);
    base_drive(&base, 337, 337, 3, 1.3);
    assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
    base_drive(&base, 100, 100, 1, 1);
    assert_int_equal(base.odometry.remainder, CREATE_DROPPED);
    base_drive(&base, 337, 337, 3, 1.3);
    assert_int_equal(base.odometry.remainder, CREATE_DROPPED);
    base_drive(&base, -TURN_MM_S, TURN_MM_S, 1, 1);
    assert_int_equal(base.odometry.standing, CREATE_CANNOT_TELL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_reported_whisk_is_no_turn_where_remainders_are_dropped),
        cmocka_unit_test(auto_sees_the_whisk_before_it_knows_the_firmware),
        cmocka_unit_test(a_straight_drive_reports_that_remainders_are_kept),
        cmocka_unit_test(a_straight_drive_reports_that_remainders_are_dropped),
        cmocka_unit_test(only_a_speed_that_separates_them_is_evidence),
        cmocka_unit_test(slow_turns_report_that_remainders_are_kept_and_never_that_they_are_dropped),
        cmocka_unit_test(evidence_outlasts_interruptions),
        cmocka_unit_test(a_push_is_no_evidence_that_remainders_are_kept),
        cmocka_unit_test(stray_numbers_are_not_believed),
    };
    return cmocka_run_group_tests_name("remainder", tests, NULL, NULL);
}
