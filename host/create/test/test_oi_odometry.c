/* Odometry of bases that keep or drop what is less than a unit, stand before a wall, wrap their encoders, lose frames.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "create/odometry.h"

#define PI 3.14159265358979323846
#define PERIOD_S 0.015
#define DEGREE (PI / 180)
#define WHISK_MM_S 17 /* pi/24 rad/s with 258 mm between the wheels, in whole mm/s */
#define WHISK_RAD_S (2 * WHISK_MM_S * 1e-3 / 0.258)

/* A base that turns its wheels as asked, and what it owes to its counters. */
struct base {
    struct create_odometry odometry;
    struct create_motion motion;
    bool keeps;
    double mm, degrees;
};

static void assert_close(double value, double expected, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.9g, expected %.9g +- %g", value, expected, tolerance);
    }
}

static struct base begin(enum create_model model, enum create_source policy, bool keeps)
{
    struct base base = {.keeps = keeps};
    struct create_odometry_settings settings;
    create_odometry_defaults(&settings, model);
    settings.policy = policy;
    assert_true(create_odometry_check(&settings));
    create_odometry_begin(&base.odometry, &settings);
    return base;
}

/* Whole units out of a counter. */
static int32_t tell(double *owed, bool keeps)
{
    const double whole = trunc(*owed);
    *owed = keeps ? *owed - whole : 0;
    return (int32_t)whole;
}

static void take(struct base *base, const struct create_frame *frame)
{
    const struct create_step step = create_odometry_take(&base->odometry, frame);
    create_motion_add(&base->motion, &step);
}

/* Drives for a time; share: of the wheels' motion that comes about (0: before a wall). */
static void drive(struct base *base, int left_mm_s, int right_mm_s, double seconds, double share)
{
    for (int i = 0; i < lround(seconds / PERIOD_S); i++) {
        struct create_frame frame = {0};
        base->mm += share * (left_mm_s + right_mm_s) / 2.0 * PERIOD_S;
        base->degrees += share * (right_mm_s - left_mm_s) / 258.0 * PERIOD_S / DEGREE;
        frame.value[CREATE_OI_DISTANCE] = tell(&base->mm, base->keeps);
        frame.value[CREATE_OI_ANGLE] = tell(&base->degrees, base->keeps);
        frame.value[CREATE_OI_REQUESTED_LEFT] = left_mm_s;
        frame.value[CREATE_OI_REQUESTED_RIGHT] = right_mm_s;
        take(base, &frame);
    }
}

static void whisk(struct base *base, double seconds)
{
    drive(base, -WHISK_MM_S, WHISK_MM_S, seconds, 1);
}

/* The trap: what a Create 1 reports of the whisk when it drops remainders. */
static void the_reported_whisk_is_no_turn_where_remainders_are_dropped(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_REPORTED, false);
    whisk(&base, 3);
    assert_true(base.motion.theta == 0);
}

static void auto_sees_the_whisk_before_it_knows_the_firmware(void **state)
{
    (void)state;
    for (int keeps = 0; keeps < 2; keeps++) {
        struct base base = begin(CREATE_1, CREATE_AUTO, keeps);
        whisk(&base, 0.6);
        assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
        assert_int_equal(base.odometry.angle, CREATE_REQUESTED);
        assert_close(base.motion.theta, 0.6 * WHISK_RAD_S, 1e-9);
    }
}

static void a_straight_drive_tells_that_remainders_are_kept(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_AUTO, true);
    drive(&base, 100, 100, 3, 0.96); /* wheels that slip by 4 % */
    assert_int_equal(base.odometry.remainder, CREATE_KEPT);
    base.motion = (struct create_motion){0};
    whisk(&base, 3);
    assert_int_equal(base.odometry.angle, CREATE_REPORTED);
    assert_close(base.motion.theta, 3 * WHISK_RAD_S, DEGREE);
}

static void a_straight_drive_tells_that_remainders_are_dropped(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_AUTO, false);
    drive(&base, 100, 100, 3, 0.96);
    assert_int_equal(base.odometry.remainder, CREATE_DROPPED);
    base.motion = (struct create_motion){0};
    drive(&base, 100, 100, 3, 1);
    assert_int_equal(base.odometry.distance, CREATE_REQUESTED);
    assert_close(base.motion.x, 0.3, 1e-9); /* told as 0.2 */
    whisk(&base, 3);
    assert_close(base.motion.theta, 3 * WHISK_RAD_S, 1e-9);
}

/* 7.5 and 3.6 mm per frame: too near whole units to tell; backwards it works as well. */
static void only_a_speed_that_tells_them_apart_is_evidence(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_AUTO, false);
    drive(&base, 500, 500, 3, 1);
    drive(&base, 200, 200, 3, 1); /* 3 mm exactly */
    assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
    drive(&base, -100, -100, 2, 1);
    assert_int_equal(base.odometry.remainder, CREATE_DROPPED);
    base.keeps = true; /* another base was plugged in */
    drive(&base, -100, -100, 2, 1);
    assert_int_equal(base.odometry.remainder, CREATE_KEPT);
}

static void before_a_wall_nothing_is_integrated_nor_learnt(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_AUTO, false);
    drive(&base, 100, 100, 3, 0);
    assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
    assert_close(base.motion.x, 2 * 100e-3 * PERIOD_S, 1e-9); /* until it was noticed */
}

#define TURN_MM_S 92 /* 0.71 rad/s, the exploration's: 0.61 degrees a frame */
#define TURN_FRAME_RAD (2 * TURN_MM_S * 1e-3 / 0.258 * PERIOD_S)

/* Zeros are what a body tells that stands: only whole units in a turn are evidence, and these against dropping. */
static void slow_turns_tell_that_remainders_are_kept_and_never_that_they_are_dropped(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_AUTO, true);
    drive(&base, -TURN_MM_S, TURN_MM_S, 1, 0.95);
    assert_int_equal(base.odometry.remainder, CREATE_KEPT);
    base = begin(CREATE_1, CREATE_AUTO, false);
    drive(&base, -TURN_MM_S, TURN_MM_S, 60, 0.95);
    drive(&base, -30, -30, 60, 1);
    assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
    assert_int_equal(base.odometry.standing, CREATE_CANNOT_TELL);
}

/* Spans of 0.3 s at the exploration's speed, a wall every other time: none alone decides. */
static void evidence_outlasts_interruptions(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_AUTO, false);
    for (int i = 0; i < 40; i++) {
        drive(&base, 150, 150, 0.3, 1);
        drive(&base, 0, 0, 0.3, 1);
        drive(&base, -150, -150, 0.3, 0);
    }
    assert_int_equal(base.odometry.remainder, CREATE_DROPPED);
}

/* The bytes of a frame that was damaged in a way its sum does not show, now and then. */
static void stray_numbers_are_not_believed(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_AUTO, false);
    for (int i = 0; i < 50; i++) {
        drive(&base, -TURN_MM_S, TURN_MM_S, 3, 1);
        base.degrees += 1;
    }
    assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
}

/* Known to keep remainders, a base that turns slower than a unit a frame is noticed when it is held. */
static void a_held_turn_is_noticed_where_remainders_are_kept(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_REQUESTED, true);
    drive(&base, -TURN_MM_S, TURN_MM_S, 1, 1);
    assert_int_equal(base.odometry.remainder, CREATE_KEPT);
    assert_int_equal(base.odometry.standing, CREATE_MOVES);
    base.motion = (struct create_motion){0};
    drive(&base, -TURN_MM_S, TURN_MM_S, 10, 0);
    assert_int_equal(base.odometry.standing, CREATE_STANDS);
    assert_true(base.motion.theta < 10 * TURN_FRAME_RAD); /* of 667 frames */
    drive(&base, -TURN_MM_S, TURN_MM_S, 4 * PERIOD_S, 1);
    assert_int_equal(base.odometry.standing, CREATE_MOVES);
}

/* Before a wall, at a third of its speed: what was told is integrated, which is at least nearer. */
static void a_body_that_is_held_back_is_believed_rather_than_its_orders(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_REQUESTED, true);
    drive(&base, 150, 150, 3, 0.33);
    assert_int_equal(base.odometry.standing, CREATE_STANDS);
    assert_close(base.motion.x, 0.33 * 0.45, 0.03);
}

static void requested_speeds_are_less_sure_than_reported_ones(void **state)
{
    (void)state;
    double requested[3][3], reported[3][3];
    struct base base = begin(CREATE_1, CREATE_REQUESTED, true);
    drive(&base, 200, 200, 1.5, 1);
    create_motion_covariance(&base.motion, requested);
    base = begin(CREATE_1, CREATE_REPORTED, true);
    drive(&base, 200, 200, 1.5, 1);
    create_motion_covariance(&base.motion, reported);
    assert_close(requested[0][0], 0.03 * 0.03, 1e-12);                  /* 10 % of 0.3 m */
    assert_close(reported[0][0], 0.015 * 0.015 + 2 * 1e-6 / 12, 1e-12); /* 5 %, and two halves of a millimetre */
    assert_close(reported[2][2], 0.015 * 0.015 + 2 * DEGREE * DEGREE / 12, 1e-12); /* 0.05 rad per m */
}

static void wheel_base_and_scales_are_settings(void **state)
{
    (void)state;
    struct create_odometry_settings settings;
    create_odometry_defaults(&settings, CREATE_1);
    settings.policy = CREATE_REQUESTED;
    settings.wheel_base_m = 0.25;
    settings.distance_scale = 1.02;
    settings.angle_scale = 0.9;
    struct base base = {0};
    create_odometry_begin(&base.odometry, &settings);
    drive(&base, 100, 150, PERIOD_S, 1);
    const struct create_frame frame = {.value = {[CREATE_OI_REQUESTED_LEFT] = 100, [CREATE_OI_REQUESTED_RIGHT] = 150}};
    const struct create_step step = create_odometry_take(&base.odometry, &frame);
    assert_close(step.distance, 0.125 * PERIOD_S * 1.02, 1e-12);
    assert_close(step.angle, 0.05 / 0.25 * PERIOD_S * 0.9, 1e-12);
}

/* Frames that never came: reported motion went with them and is estimated, all of it in doubt. */
static void motion_of_missed_frames_is_estimated(void **state)
{
    (void)state;
    struct base base = begin(CREATE_1, CREATE_REPORTED, true);
    struct create_frame frame = {0};
    frame.value[CREATE_OI_REQUESTED_LEFT] = frame.value[CREATE_OI_REQUESTED_RIGHT] = 200;
    take(&base, &frame);
    base.motion = (struct create_motion){0};
    frame.missed = 4;
    frame.value[CREATE_OI_DISTANCE] = 3;
    frame.value[CREATE_OI_REQUESTED_LEFT] = 0; /* what it was asked before counts */
    frame.value[CREATE_OI_REQUESTED_RIGHT] = 0;
    take(&base, &frame);
    double c[3][3];
    create_motion_covariance(&base.motion, c);
    assert_close(base.motion.x, 5 * 0.003, 1e-12);
    assert_close(c[0][0], 0.012 * 0.012 + 0.00015 * 0.00015 + 2 * 1e-6 / 12, 1e-12);
    assert_int_equal(base.odometry.estimated, 4);
}

static void count(struct base *base, int32_t left, int32_t right, uint32_t missed)
{
    struct create_frame frame = {.missed = missed};
    frame.value[CREATE_OI_ENCODER_LEFT] = left;
    frame.value[CREATE_OI_ENCODER_RIGHT] = right;
    take(base, &frame);
}

/* 508.8 counts to a turn of 72 mm: 0.444565 mm a count. */
static void encoders_wrap(void **state)
{
    (void)state;
    struct base base = begin(CREATE_2, CREATE_AUTO, true);
    count(&base, 32760, -32765, 0);
    assert_close(base.motion.x, 0, 0);
    count(&base, -32766, 32761, 0); /* 10 forward, 10 back */
    assert_int_equal(base.odometry.angle, CREATE_ENCODERS);
    assert_close(base.motion.x, 0, 1e-12);
    assert_close(base.motion.theta, -20 * 0.000444565 / 0.235, 1e-7);
    count(&base, -32756, -32765, 0); /* both 10 forward */
    assert_close(hypot(base.motion.x, base.motion.y), 10 * 0.000444565, 1e-7);
}

static void encoders_bridge_missed_frames_and_a_new_beginning_does_not_count(void **state)
{
    (void)state;
    struct base base = begin(CREATE_2, CREATE_AUTO, true);
    count(&base, 100, 100, 0);
    count(&base, 190, 190, 5);
    assert_close(base.motion.x, 90 * 0.000444565, 1e-7);
    assert_int_equal(base.odometry.estimated, 0);
    count(&base, 3, 190, 2); /* 83 mm back in 45 ms */
    count(&base, 3, 3, 2);
    assert_close(base.motion.x, 90 * 0.000444565, 1e-7);
    assert_int_equal(base.odometry.estimated, 4);
    count(&base, 4, 4, 0);
    assert_close(base.motion.x, 91 * 0.000444565, 1e-7);
}

/* Encoders count, whatever the packets 19 and 20 of an old firmware tell: here nothing. */
static void encoders_tell_that_a_body_stands(void **state)
{
    (void)state;
    struct base base = begin(CREATE_2, CREATE_AUTO, true);
    struct create_frame frame = {0};
    frame.value[CREATE_OI_REQUESTED_LEFT] = -100;
    frame.value[CREATE_OI_REQUESTED_RIGHT] = 100;
    for (int i = 0; i < 20; i++) {
        frame.value[CREATE_OI_ENCODER_LEFT] -= 3; /* 1.33 of 1.5 mm */
        frame.value[CREATE_OI_ENCODER_RIGHT] += 3;
        take(&base, &frame);
        assert_int_equal(base.odometry.standing, CREATE_MOVES);
    }
    for (int i = 0; i < 10; i++) {
        take(&base, &frame);
    }
    assert_int_equal(base.odometry.standing, CREATE_STANDS);
}

static void settings_that_cannot_be_are_refused(void **state)
{
    (void)state;
    struct create_odometry_settings settings;
    create_odometry_defaults(&settings, CREATE_1);
    settings.policy = CREATE_ENCODERS;
    assert_false(create_odometry_check(&settings));
    create_odometry_defaults(&settings, CREATE_2);
    settings.wheel_base_m = 0;
    assert_false(create_odometry_check(&settings));
    create_odometry_defaults(&settings, CREATE_2);
    settings.angle_scale = NAN;
    assert_false(create_odometry_check(&settings));
    create_odometry_defaults(&settings, CREATE_2);
    settings.drift_rad_per_m = -1;
    assert_false(create_odometry_check(&settings));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_reported_whisk_is_no_turn_where_remainders_are_dropped),
        cmocka_unit_test(auto_sees_the_whisk_before_it_knows_the_firmware),
        cmocka_unit_test(a_straight_drive_tells_that_remainders_are_kept),
        cmocka_unit_test(a_straight_drive_tells_that_remainders_are_dropped),
        cmocka_unit_test(only_a_speed_that_tells_them_apart_is_evidence),
        cmocka_unit_test(before_a_wall_nothing_is_integrated_nor_learnt),
        cmocka_unit_test(slow_turns_tell_that_remainders_are_kept_and_never_that_they_are_dropped),
        cmocka_unit_test(evidence_outlasts_interruptions),
        cmocka_unit_test(stray_numbers_are_not_believed),
        cmocka_unit_test(a_held_turn_is_noticed_where_remainders_are_kept),
        cmocka_unit_test(a_body_that_is_held_back_is_believed_rather_than_its_orders),
        cmocka_unit_test(requested_speeds_are_less_sure_than_reported_ones),
        cmocka_unit_test(wheel_base_and_scales_are_settings),
        cmocka_unit_test(motion_of_missed_frames_is_estimated),
        cmocka_unit_test(encoders_wrap),
        cmocka_unit_test(encoders_bridge_missed_frames_and_a_new_beginning_does_not_count),
        cmocka_unit_test(encoders_tell_that_a_body_stands),
        cmocka_unit_test(settings_that_cannot_be_are_refused),
    };
    return cmocka_run_group_tests_name("odometry", tests, NULL, NULL);
}
