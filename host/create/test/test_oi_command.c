/* Orders byte by byte, and the speeds that a base can really drive. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "create/command.h"

#define PI 3.14159265358979323846

static const double base_1 = 0.258, base_2 = 0.235; /* between the wheels, m */

#define assert_bytes(count, ...)                                                                                       \
    do {                                                                                                               \
        static const uint8_t expected[] = {__VA_ARGS__};                                                               \
        assert_int_equal(count, sizeof expected);                                                                      \
        assert_memory_equal(bytes, expected, sizeof expected);                                                         \
    } while (0)

static void orders_are_those_of_the_manual(void **state)
{
    (void)state;
    uint8_t bytes[CREATE_COMMAND_BYTES];
    assert_bytes(create_put_drive(bytes, -200, 500), 137, 255, 56, 1, 244); /* the manual's example */
    assert_bytes(create_put_drive(bytes, 500, CREATE_OI_RADIUS_STRAIGHT), 137, 1, 244, 127, 255);
    assert_bytes(create_put_drive(bytes, 100, CREATE_OI_RADIUS_TURN_RIGHT), 137, 0, 100, 255, 255);
    assert_bytes(create_put_drive_direct(bytes, 500, -500), 145, 1, 244, 254, 12); /* right first */
    assert_bytes(create_put_stream(bytes, (const uint8_t[]){29, 13}, 2), 148, 2, 29, 13);
    assert_bytes(create_put_pause(bytes), 150, 0);
    assert_bytes(create_put_baud(bytes, 57600), 129, 10);
    assert_bytes(create_put_opcode(bytes, CREATE_OI_OP_START), 128);
    assert_bytes(create_put_opcode(bytes, CREATE_OI_OP_SAFE), 131);
    assert_bytes(create_put_opcode(bytes, CREATE_OI_OP_FULL), 132);
}

static void a_stop_ends_any_order_cut_short(void **state)
{
    (void)state;
    uint8_t bytes[CREATE_COMMAND_BYTES];
    const size_t count = create_put_stop(bytes);
    assert_true(count <= CREATE_COMMAND_BYTES);
    assert_true(count - 5 >= 16); /* the longest the driver sends: a stream of 16 packets, all of them missing */
    for (size_t i = 0; i < count; i++) {
        assert_int_equal(bytes[i], i == count - 5 ? CREATE_OI_OP_DRIVE_DIRECT : 0);
    }
}

static void assert_speeds(struct create_speeds speeds, int left, int right, double v, double omega)
{
    assert_int_equal(speeds.left_mm_s, left);
    assert_int_equal(speeds.right_mm_s, right);
    assert_true(fabs(speeds.v_m_s - v) < 1e-9 && fabs(speeds.omega_rad_s - omega) < 1e-9);
}

static void create_1_turns_its_wheels_at_whole_millimetres(void **state)
{
    (void)state;
    assert_speeds(create_choose_speeds(CREATE_1, base_1, 0, PI / 24), -17, 17, 0, 0.034 / base_1);
    assert_speeds(create_choose_speeds(CREATE_1, base_1, 0.1, 0), 100, 100, 0.1, 0);
    assert_speeds(create_choose_speeds(CREATE_1, base_1, -0.0504, 0), -50, -50, -0.05, 0);
    assert_speeds(create_choose_speeds(CREATE_1, base_1, 0.1, 0.1 / base_1), 50, 150, 0.1, 0.1 / base_1);
}

/* The whisk asks for wheels at 15.4 mm/s; Create 2 can only do 28.5: it turns on the spot all the same, and says how
 * fast. */
static void create_2_turns_its_wheels_in_steps(void **state)
{
    (void)state;
    assert_speeds(create_choose_speeds(CREATE_2, base_2, 0, PI / 24), -29, 29, 0, 2 * 0.0285 / base_2);
    assert_speeds(create_choose_speeds(CREATE_2, base_2, 0, -PI / 24), 29, -29, 0, -2 * 0.0285 / base_2);
    assert_speeds(create_choose_speeds(CREATE_2, base_2, 0.15, 0), 143, 143, 5 * 0.0285, 0);
    assert_speeds(create_choose_speeds(CREATE_2, base_2, 0.005, 0), 29, 29, 0.0285, 0);
    /* 76.5 and 123.5 mm/s, as 0.62 to 1: 3 and 5 steps are 0.6 to 1, though 4 steps were nearer to 123.5 */
    assert_speeds(create_choose_speeds(CREATE_2, base_2, 0.1, 0.2), 86, 143, 4 * 0.0285, 2 * 0.0285 / base_2);
}

static void both_wheels_slow_down_alike(void **state)
{
    (void)state;
    assert_speeds(create_choose_speeds(CREATE_1, base_1, 0.75, 0.5 / base_1), 250, 500, 0.375, 0.25 / base_1);
    assert_speeds(create_choose_speeds(CREATE_2, base_2, -9, 0), -485, -485, -17 * 0.0285, 0);
}

static void what_is_no_speed_is_a_stop(void **state)
{
    (void)state;
    assert_speeds(create_choose_speeds(CREATE_1, base_1, 0, 0), 0, 0, 0, 0);
    assert_speeds(create_choose_speeds(CREATE_1, base_1, 0.0004, 0), 0, 0, 0, 0);
    assert_speeds(create_choose_speeds(CREATE_1, base_1, NAN, 0.1), 0, 0, 0, 0);
    assert_speeds(create_choose_speeds(CREATE_2, base_2, INFINITY, 0), 0, 0, 0, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(orders_are_those_of_the_manual),
        cmocka_unit_test(a_stop_ends_any_order_cut_short),
        cmocka_unit_test(create_1_turns_its_wheels_at_whole_millimetres),
        cmocka_unit_test(create_2_turns_its_wheels_in_steps),
        cmocka_unit_test(both_wheels_slow_down_alike),
        cmocka_unit_test(what_is_no_speed_is_a_stop),
    };
    return cmocka_run_group_tests_name("command", tests, NULL, NULL);
}
