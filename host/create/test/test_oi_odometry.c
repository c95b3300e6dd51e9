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
    assert_close(requested[0][0], 0.03 * 0.03 + 0.003 * 0.003 / 12,
                 1e-12);                                                /* 10 % of 0.3 m, when in a frame it began */
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

/* Frames that never came: reported motion went with them and is estimated. What was asked for all the time is as sure
 * as integrated requests are; what changed meanwhile did so at any time; and somebody in haste, of 2 m/s at 8 sigma,
 * may have pushed it, unless encoders count. */
static void motion_of_missed_frames_is_estimated(void **state)
{
    (void)state;
    static const struct {
        int32_t asked_mm_s;
        double frames, doubt;
    } cases[] = {{200, 4, 0.1 * 4}, {0, 2, 4 * 0.28867513459481287}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct base base = base_begin(CREATE_1, CREATE_REPORTED, true);
        struct create_frame frame = {0};
        frame.value[CREATE_OI_REQUESTED_LEFT] = frame.value[CREATE_OI_REQUESTED_RIGHT] = 200;
        base_take(&base, &frame);
        base.motion = (struct create_motion){0};
        frame.missed = 4;
        frame.value[CREATE_OI_DISTANCE] = 3;
        frame.value[CREATE_OI_REQUESTED_LEFT] = frame.value[CREATE_OI_REQUESTED_RIGHT] = cases[i].asked_mm_s;
        base_take(&base, &frame);
        const double doubt_m =
            hypot(hypot(cases[i].doubt * 0.003, i == 1 ? 0.1 * 2 * 0.003 : 0), 2.0 / 8 * 4 * PERIOD_S);
        double c[3][3];
        create_motion_covariance(&base.motion, c);
        assert_close(base.motion.x, (1 + cases[i].frames) * 0.003, 1e-12);
        assert_close(c[0][0], doubt_m * doubt_m + 0.00015 * 0.00015 + 2 * 1e-6 / 12, 1e-12);
        assert_int_equal(base.odometry.estimated, 4);
    }
}

/* It was counted as missed, and comes after all: what it was thought to be is taken back. */
static void a_late_frame_takes_its_estimate_back(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_REPORTED, true);
    struct create_frame frame = {0};
    frame.value[CREATE_OI_REQUESTED_LEFT] = frame.value[CREATE_OI_REQUESTED_RIGHT] = 200;
    frame.value[CREATE_OI_DISTANCE] = 3;
    base_take(&base, &frame);
    base.motion = (struct create_motion){0};
    frame.missed = 1;
    base_take(&base, &frame);
    frame.missed = 0;
    frame.timing = CREATE_LATE;
    frame.value[CREATE_OI_DISTANCE] = 1;
    base_take(&base, &frame);
    assert_close(base.motion.x, 0.004, 1e-12);
}

/* One bound for every source, by what wheels can do: their own speed, a push, and what is no motion. */
static void what_is_beyond_the_wheels_is_in_doubt_or_counts_as_carried(void **state)
{
    (void)state;
    static const struct {
        double mm, x_m, least_sigma_m;
        bool carried;
    } cases[] = {{10, 0.010, 0, false}, {40, 0.040, 0.040, false}, {12780, 0, 0.02, true}, {-32768, 0, 0.02, true}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        for (int encoders = 0; encoders < 2; encoders++) {
            const double counts = cases[i].mm / 0.444565;
            if (encoders && fabs(counts) > INT16_MAX) {
                continue; /* they wrap before */
            }
            struct base base =
                base_begin(encoders ? CREATE_2 : CREATE_1, encoders ? CREATE_AUTO : CREATE_REPORTED, true);
            struct create_frame frame = {0};
            base_take(&base, &frame);
            base.motion = (struct create_motion){0};
            frame.value[CREATE_OI_DISTANCE] = (int32_t)cases[i].mm;
            frame.value[CREATE_OI_ENCODER_LEFT] = frame.value[CREATE_OI_ENCODER_RIGHT] = (int32_t)lround(counts);
            base_take(&base, &frame);
            double c[3][3];
            create_motion_covariance(&base.motion, c);
            assert_close(base.motion.x, cases[i].x_m, 5e-4);
            assert_true(sqrt(c[0][0]) >= cases[i].least_sigma_m - 5e-4);
            assert_int_equal(base.odometry.carried, cases[i].carried);
        }
    }
}

/* A base that was asked to stand, or for less than a unit a frame, and reports more: somebody moves it. */
static void a_push_counts_where_requests_are_integrated(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_AUTO, true);
    struct create_frame frame = {0};
    base_take(&base, &frame);
    frame.value[CREATE_OI_DISTANCE] = 5;
    frame.value[CREATE_OI_ANGLE] = -2;
    frame.value[CREATE_OI_REQUESTED_LEFT] = -WHISK_MM_S;
    frame.value[CREATE_OI_REQUESTED_RIGHT] = WHISK_MM_S;
    base_take(&base, &frame);
    assert_close(hypot(base.motion.x, base.motion.y), 0.005, 1e-5);
    assert_close(base.motion.theta, -2 * DEGREE, 1e-12);
}

/* Said twice, or made up: there is no time for it. */
static void a_frame_that_the_clock_has_no_time_for_is_in_doubt(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_REPORTED, true);
    struct create_frame frame = {.timing = CREATE_SURPLUS};
    frame.value[CREATE_OI_DISTANCE] = 3;
    base_take(&base, &frame);
    double c[3][3];
    create_motion_covariance(&base.motion, c);
    assert_close(base.motion.x, 0.003, 1e-12);
    assert_true(sqrt(c[0][0]) >= 0.003);
}

/* No order can ask for more than the greatest speed: nor is more integrated. */
static void a_request_beyond_the_greatest_speed_is_none(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_REQUESTED, true);
    struct create_frame frame = {0};
    frame.value[CREATE_OI_REQUESTED_LEFT] = frame.value[CREATE_OI_REQUESTED_RIGHT] = INT16_MAX;
    base_take(&base, &frame);
    assert_close(base.motion.x, CREATE_OI_SPEED_MAX_MM_S * 1e-3 * PERIOD_S, 1e-12);
}

/* The driver ordered other speeds while it heard nothing. The base says that it was asked for the last of them: it did
 * what was ordered; otherwise it went on as before. */
static void missed_frames_after_an_order_are_worth_what_the_base_heard_of_it(void **state)
{
    (void)state;
    static const struct {
        int32_t asked_mm_s;
        bool heard;
        double ordered, frames;
    } cases[] = {{0, true, 0.3, 30}, {200, false, 0.3, 100}, {100, true, 0.65, 65}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct base base = base_begin(CREATE_1, CREATE_REPORTED, true);
        struct create_frame frame = {0};
        frame.value[CREATE_OI_REQUESTED_LEFT] = frame.value[CREATE_OI_REQUESTED_RIGHT] = 200;
        frame.value[CREATE_OI_DISTANCE] = 3;
        base_take(&base, &frame);
        base.motion = (struct create_motion){0};
        frame.value[CREATE_OI_DISTANCE] = 0;
        frame.missed = 100;
        frame.ordered = (struct create_ordered){.changed = true, .heard = cases[i].heard};
        frame.ordered.distance = frame.ordered.way = 101 * cases[i].ordered * 0.003; /* in all frames, this one too */
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
    count(&base, 9000, 190, 2); /* 3.9 m in 45 ms */
    count(&base, 9000, 9000, 2);
    assert_close(base.motion.x, 90 * 0.000444565, 1e-7);
    assert_int_equal(base.odometry.carried, 2);
    count(&base, 9001, 9001, 0);
    assert_close(base.motion.x, 91 * 0.000444565, 1e-7);
}

/* A base that was not heard and counts little: it may have been started anew, and where it drove before nobody knows.
 */
static void counts_after_a_silence_are_carried_where_they_may_begin_anew(void **state)
{
    (void)state;
    static const struct {
        int32_t before, after;
        bool unheard, carried;
    } cases[] = {{500, 0, true, true}, {500, 100, true, true}, {500, 0, false, false}, {9000, 9200, true, false}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct base base = base_begin(CREATE_2, CREATE_AUTO, true);
        struct create_frame frame = {.missed = 100, .unheard = cases[i].unheard};
        count(&base, cases[i].before, cases[i].before, 0);
        frame.value[CREATE_OI_ENCODER_LEFT] = frame.value[CREATE_OI_ENCODER_RIGHT] = cases[i].after;
        base_take(&base, &frame);
        assert_int_equal(base.odometry.carried, cases[i].carried);
    }
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
        cmocka_unit_test(a_late_frame_takes_its_estimate_back),
        cmocka_unit_test(what_is_beyond_the_wheels_is_in_doubt_or_counts_as_carried),
        cmocka_unit_test(a_push_counts_where_requests_are_integrated),
        cmocka_unit_test(a_frame_that_the_clock_has_no_time_for_is_in_doubt),
        cmocka_unit_test(a_request_beyond_the_greatest_speed_is_none),
        cmocka_unit_test(missed_frames_after_an_order_are_worth_what_the_base_heard_of_it),
        cmocka_unit_test(encoders_wrap),
        cmocka_unit_test(encoders_bridge_missed_frames_and_a_new_beginning_does_not_count),
        cmocka_unit_test(counts_after_a_silence_are_carried_where_they_may_begin_anew),
        cmocka_unit_test(settings_that_cannot_be_are_refused),
    };
    return cmocka_run_group_tests_name("odometry", tests, NULL, NULL);
}
