/* Bases that stand, or are held back, whatever their wheels were asked for. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "odometry_base.h"

static void before_a_wall_nothing_is_integrated_nor_learnt(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_AUTO, false);
    base_drive(&base, 100, 100, 3, 0);
    assert_int_equal(base.odometry.remainder, CREATE_UNKNOWN);
    assert_close(base.motion.x, 2 * 100e-3 * PERIOD_S, 1e-9); /* until it was noticed */
}

/* Known to keep remainders, a base that turns slower than a unit a frame is noticed when it is held. */
static void a_held_turn_is_noticed_where_remainders_are_kept(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_REQUESTED, true);
    base_drive(&base, -TURN_MM_S, TURN_MM_S, 1, 1);
    assert_int_equal(base.odometry.remainder, CREATE_KEPT);
    assert_int_equal(base.odometry.standing, CREATE_MOVES);
    base.motion = (struct create_motion){0};
    base_drive(&base, -TURN_MM_S, TURN_MM_S, 10, 0);
    assert_int_equal(base.odometry.standing, CREATE_STANDS);
    assert_true(base.motion.theta < 10 * TURN_FRAME_RAD); /* of 667 frames */
    base_drive(&base, -TURN_MM_S, TURN_MM_S, 4 * PERIOD_S, 1);
    assert_int_equal(base.odometry.standing, CREATE_MOVES);
}

/* Before a wall, at a third of its speed: what was reported is integrated, which is at least nearer. */
static void a_body_that_is_held_back_is_believed_rather_than_its_orders(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_1, CREATE_REQUESTED, true);
    base_drive(&base, 150, 150, 3, 0.33);
    assert_int_equal(base.odometry.standing, CREATE_STANDS);
    assert_close(base.motion.x, 0.33 * 0.45, 0.03);
}

/* Encoders count, whatever the packets 19 and 20 of an old firmware report: here nothing. */
static void encoders_report_that_a_body_stands(void **state)
{
    (void)state;
    struct base base = base_begin(CREATE_2, CREATE_AUTO, true);
    struct create_frame frame = {0};
    frame.value[CREATE_OI_REQUESTED_LEFT] = -100;
    frame.value[CREATE_OI_REQUESTED_RIGHT] = 100;
    for (int i = 0; i < 20; i++) {
        frame.value[CREATE_OI_ENCODER_LEFT] -= 3; /* 1.33 of 1.5 mm */
        frame.value[CREATE_OI_ENCODER_RIGHT] += 3;
        base_take(&base, &frame);
        assert_int_equal(base.odometry.standing, CREATE_MOVES);
    }
    for (int i = 0; i < 10; i++) {
        base_take(&base, &frame);
    }
    assert_int_equal(base.odometry.standing, CREATE_STANDS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(before_a_wall_nothing_is_integrated_nor_learnt),
        cmocka_unit_test(a_held_turn_is_noticed_where_remainders_are_kept),
        cmocka_unit_test(a_body_that_is_held_back_is_believed_rather_than_its_orders),
        cmocka_unit_test(encoders_report_that_a_body_stands),
    };
    return cmocka_run_group_tests_name("standing", tests, NULL, NULL);
}
