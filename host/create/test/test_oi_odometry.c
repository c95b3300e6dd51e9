/* What counts as motion, and how sure it is: scales, missed frames, encoders that wrap. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "odometry_base.h"

static void requested_speeds_are_less_sure_than_reported_ones(void **state)
{
    (void)state;
    double requested[3][3], reported[3][3];
    struct base base = base_begin(CREATE_1, CREATE_REQUESTED, true);
    base_drive(&base, 200, 200, 1.5, 1);
    create_motion_covariance(&base.motion, requested);
    base = base_begin(CREATE_1, CREATE_REPORTED, true);
    base_drive(&base, 200, 200, 1.5, 1);
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
    base_drive(&base, 100, 150, PERIOD_S, 1);
    const struct create_frame frame = {.value = {[CREATE_OI_REQUESTED_LEFT] = 100, [CREATE_OI_REQUESTED_RIGHT] = 150}};
    const struct create_step step = create_odometry_take(&base.odometry, &frame);
    assert_close(step.distance, 0.125 * PERIOD_S * 1.02, 1e-12);
    assert_close(step.angle, 0.05 / 0.25 * PERIOD_S * 0.9, 1e-12);
}

/* Frames that never came: reported motion went with them and is estimated, all of it in doubt. */
static void motion_of_missed_frames_is_estimated(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_REPORTED, true);
    struct create_frame frame = {0};
    frame.value[CREATE_OI_REQUESTED_LEFT] = frame.value[CREATE_OI_REQUESTED_RIGHT] = 200;
    base_take(&base, &frame);
    base.motion = (struct create_motion){0};
    frame.missed = 4;
    frame.value[CREATE_OI_DISTANCE] = 3;
    frame.value[CREATE_OI_REQUESTED_LEFT] = 0; /* what it was asked before counts */
    frame.value[CREATE_OI_REQUESTED_RIGHT] = 0;
    base_take(&base, &frame);
    double c[3][3];
    create_motion_covariance(&base.motion, c);
    assert_close(base.motion.x, 5 * 0.003, 1e-12);
    assert_close(c[0][0], 0.012 * 0.012 + 0.00015 * 0.00015 + 2 * 1e-6 / 12, 1e-12);
    assert_int_equal(base.odometry.estimated, 4);
}

/* The driver ordered a stop while it heard nothing. Asked for nothing now: it was heard; for the same: it was not. */
static void missed_frames_after_an_order_are_worth_what_is_asked_now(void **state)
{
    (void)state;
    static const struct {
        int32_t asked_mm_s;
        double frames;
    } cases[] = {{0, 30}, {200, 100}, {100, 30 + 0.5 * 70}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct base base = base_begin(CREATE_1, CREATE_REPORTED, true);
        struct create_frame frame = {0};
        frame.value[CREATE_OI_REQUESTED_LEFT] = frame.value[CREATE_OI_REQUESTED_RIGHT] = 200;
        frame.value[CREATE_OI_DISTANCE] = 3;
        base_take(&base, &frame);
        base.motion = (struct create_motion){0};
        frame.value[CREATE_OI_DISTANCE] = 0;
        frame.missed = 100;
        frame.ordered = 70;
        frame.value[CREATE_OI_REQUESTED_LEFT] = frame.value[CREATE_OI_REQUESTED_RIGHT] = cases[i].asked_mm_s;
        base_take(&base, &frame);
        assert_close(base.motion.x, cases[i].frames * 0.003, 1e-12);
        double c[3][3];
        create_motion_covariance(&base.motion, c);
        assert_true(sqrt(c[0][0]) >= 100 * 0.003); /* in doubt is all that it may have driven, heard or not */
        assert_int_equal(base.odometry.estimated, 100);
    }
}

static void count(struct base *base, int32_t left, int32_t right, uint32_t missed)
{
    struct create_frame frame = {.missed = missed};
    frame.value[CREATE_OI_ENCODER_LEFT] = left;
    frame.value[CREATE_OI_ENCODER_RIGHT] = right;
    base_take(base, &frame);
}

/* 508.8 counts to a turn of 72 mm: 0.444565 mm a count. */
static void encoders_wrap(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_2, CREATE_AUTO, true);
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
    struct base base = base_begin(CREATE_2, CREATE_AUTO, true);
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
        cmocka_unit_test(requested_speeds_are_less_sure_than_reported_ones),
        cmocka_unit_test(wheel_base_and_scales_are_settings),
        cmocka_unit_test(motion_of_missed_frames_is_estimated),
        cmocka_unit_test(missed_frames_after_an_order_are_worth_what_is_asked_now),
        cmocka_unit_test(encoders_wrap),
        cmocka_unit_test(encoders_bridge_missed_frames_and_a_new_beginning_does_not_count),
        cmocka_unit_test(settings_that_cannot_be_are_refused),
    };
    return cmocka_run_group_tests_name("odometry", tests, NULL, NULL);
}
