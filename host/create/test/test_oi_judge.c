/* The one rule for motions, by hand: wheels of 0.4 m/s that are 0.5 m apart. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "create/judge.h"

static const struct create_reach reach = {.speed_m_s = 0.4, .wheel_base_m = 0.5};

static void test_the_faster_wheel_counts(void **state)
{
    (void)state;
    assert_true(fabs(create_wheel_way(&reach, 0.1, 0.2) - 0.15) < 1e-12);
    assert_true(fabs(create_wheel_way(&reach, -0.1, 0.2) - 0.15) < 1e-12);
    assert_true(fabs(create_driven_most(&reach, 0.5) - 0.22) < 1e-12);
}

static void test_what_wheels_drive_is_believed_and_what_is_pushed_is_not_carried(void **state)
{
    (void)state;
    assert_int_equal(create_judge(&reach, 0.0439, 0, 0, 0.1), CREATE_DRIVEN);
    assert_int_equal(create_judge(&reach, 0.0441, 0, 0, 0.1), CREATE_PUSHED);
    assert_int_equal(create_judge(&reach, 0, -4 * 0.0441, 0, 0.1), CREATE_PUSHED);
    assert_int_equal(create_judge(&reach, 0.199, 0, 0, 0.1), CREATE_PUSHED);
    assert_int_equal(create_judge(&reach, 0.201, 0, 0, 0.1), CREATE_CARRIED);
}

static void test_what_is_pushed_adds_to_what_was_asked_for(void **state)
{
    (void)state;
    assert_int_equal(create_judge(&reach, 0.221, 0, 0.2, 0.1), CREATE_PUSHED);
    assert_int_equal(create_judge(&reach, 0.223, 0, 0.2, 0.1), CREATE_CARRIED);
    assert_int_equal(create_judge(&reach, 0.245, 0, 9, 0.1),
                     CREATE_CARRIED); /* no wheel is asked for more than it can */
}

static void test_nobody_pushes_for_longer_than_half_a_second(void **state)
{
    (void)state;
    assert_int_equal(create_judge(&reach, 0.99, 0, 0, 2), CREATE_PUSHED);
    assert_int_equal(create_judge(&reach, 1.01, 0, 0, 2), CREATE_CARRIED);
}

static void test_what_is_no_number_is_carried(void **state)
{
    (void)state;
    assert_int_equal(create_judge(&reach, NAN, 0, 0, 0.1), CREATE_CARRIED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_faster_wheel_counts),
        cmocka_unit_test(test_what_wheels_drive_is_believed_and_what_is_pushed_is_not_carried),
        cmocka_unit_test(test_what_is_pushed_adds_to_what_was_asked_for),
        cmocka_unit_test(test_nobody_pushes_for_longer_than_half_a_second),
        cmocka_unit_test(test_what_is_no_number_is_carried),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
