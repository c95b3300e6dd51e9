#include "near.h"
#include "whisks.h"

static void onset_stop_release_and_peak_come_from_lines(void **state)
{
    (void)state;
    struct drawn_whisk w = usual_whisk();
    w.rate = 0.13;
    w.reported = 0.12;
    struct nav_shape s = shape_of_whisk(&w, 2);
    assert_int_equal(s.quality, NAV_SHAPE_WHOLE);
    assert_near(s.onset_s, 5.2, 0.003);
    assert_near(s.stop_s, 5.8, 0.003);
    assert_near(s.release_s, 6.4, 0.003);
    assert_near(s.peak, 1500.0, 10.0);
    assert_near(s.slope, 2500.0, 15.0);
    assert_near(s.turn, 0.13 * 0.6, 0.13 * 0.005);
    assert_near(s.reported, 0.12 * 0.6, 0.12 * 0.005);
    assert_near(s.back, 0.0, 0.01);
    assert_near(s.bow, 0.0, 0.02);
    assert_near(s.direction[0], 0.6, 0.01);
    assert_near(s.direction[1], -0.8, 0.01);
}

static void any_rate_and_number_of_channels_will_do(void **state)
{
    (void)state;
    const double rates[] = {35, 100, 500, 2000, 5000};
    for (int i = 0; i < 5; i++)
        for (int axes = 1; axes <= NAV_TRACE_AXES; axes++) {
            struct drawn_whisk w = usual_whisk();
            w.hz = rates[i];
            struct nav_shape s = shape_of_whisk(&w, axes);
            assert_int_equal(s.quality, NAV_SHAPE_WHOLE);
            assert_near(s.peak, 1500.0, 45.0);
            assert_near(s.stop_s - s.onset_s, 0.6, 0.03);
        }
}

static void a_hold_belongs_to_no_push(void **state)
{
    (void)state;
    struct drawn_whisk w = usual_whisk();
    w.hold_s = 0.4;
    struct nav_shape s = shape_of_whisk(&w, 2);
    assert_near(s.stop_s, 5.8, 0.006);
    assert_near(s.release_s, 6.8, 0.006);
    assert_near(s.back, log(1.0 / 0.6), 0.02);
}

static void a_recording_may_end_with_the_push(void **state)
{
    (void)state;
    struct drawn_whisk w = usual_whisk();
    w.cut_s = 0.7;
    struct nav_shape s = shape_of_whisk(&w, 2);
    assert_int_equal(s.quality, NAV_SHAPE_WHOLE);
    assert_near(s.stop_s, 5.7, 0.002);
    assert_near(s.peak, 1250.0, 12.0);
    assert_true(isnan(s.release_s) && isnan(s.back));
}

static void bad_records_and_numbers_that_are_none_move_little(void **state)
{
    (void)state;
    struct drawn_whisk w = usual_whisk();
    w.bad_every = 100;
    w.nan_every = 50;
    struct nav_shape s = shape_of_whisk(&w, 2);
    assert_int_equal(s.quality, NAV_SHAPE_WHOLE);
    assert_near(s.peak, 1500.0, 10.0);
    assert_near(s.onset_s, 5.2, 0.004);
    assert_near(s.bad, 0.02, 0.001);
}

static void what_is_clipped_or_stands_still_shows_in_frozen(void **state)
{
    (void)state;
    struct drawn_whisk stuck = usual_whisk(), fine = usual_whisk();
    stuck.frozen_s = 0.6;
    assert_true(shape_of_whisk(&stuck, 2).frozen > 0.5);
    assert_true(shape_of_whisk(&fine, 2).frozen < 0.02);
    struct drawn_whisk clipped = usual_whisk();
    clipped.clip = 900.0;
    clipped.noise = 0.0;
    assert_true(shape_of_whisk(&clipped, 2).frozen > 0.5);
}

static void nothing_is_nothing(void **state)
{
    (void)state;
    struct drawn_whisk none = usual_whisk(), dead = usual_whisk();
    none.peak = 0.0;
    assert_int_equal(shape_of_whisk(&none, 2).quality, NAV_SHAPE_NONE);
    dead.noise = dead.peak = 0.0;
    assert_int_equal(shape_of_whisk(&dead, 2).quality, NAV_SHAPE_NONE);
    dead.nan_every = 1;
    struct nav_shape s = shape_of_whisk(&dead, 1);
    assert_int_equal(s.quality, NAV_SHAPE_NONE);
    assert_near(s.bad, 1.0, 0.0);
}

static void a_trace_keeps_means_whatever_its_length(void **state)
{
    (void)state;
    static struct nav_trace trace;
    nav_trace_begin(&trace, 1);
    double sum = 0.0;
    int n = 0;
    for (int i = 0; i < 100000; i++)
        nav_trace_add(&trace, i * 1e-3, &(double){i}, (double)NAN, (double)NAN);
    for (int b = 0; b < trace.used; b++) {
        n += b == trace.used - 1 ? trace.filled : trace.width;
        sum += trace.sum[b].at[0];
    }
    assert_int_equal(n, 100000 - NAV_TRACE_MEDIAN + 1);
    assert_near(sum / n, 99999.0 / 2.0, 1e-6);
    assert_true(trace.used > NAV_TRACE_BINS / 2 && trace.used <= NAV_TRACE_BINS);
    nav_trace_add(&trace, 99.9, &(double){0}, (double)NAN, (double)NAN);
    assert_int_equal(trace.bad, 1);
}

static void two_wild_samples_of_five_are_outvoted(void **state)
{
    (void)state;
    static struct nav_trace trace;
    const double values[] = {1, 9e5, 3, -9e5, 2};
    nav_trace_begin(&trace, 1);
    for (int i = 0; i < 5; i++)
        nav_trace_add(&trace, i, &values[i], (double)NAN, (double)NAN);
    assert_int_equal(trace.used, 1);
    assert_near(trace.sum[0].at[0], 2.0, 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(onset_stop_release_and_peak_come_from_lines),
        cmocka_unit_test(any_rate_and_number_of_channels_will_do),
        cmocka_unit_test(a_hold_belongs_to_no_push),
        cmocka_unit_test(a_recording_may_end_with_the_push),
        cmocka_unit_test(bad_records_and_numbers_that_are_none_move_little),
        cmocka_unit_test(what_is_clipped_or_stands_still_shows_in_frozen),
        cmocka_unit_test(nothing_is_nothing),
        cmocka_unit_test(a_trace_keeps_means_whatever_its_length),
        cmocka_unit_test(two_wild_samples_of_five_are_outvoted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
