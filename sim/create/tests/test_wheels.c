/* Driving: speeds of the wheels by command, Create 2's steps, and how commands are put together. */
#include "robot.h"

static void drive(int velocity, int radius)
{
    SEND(CREATE_OI_OP_DRIVE, HIGH(velocity), LOW(velocity), HIGH(radius), LOW(radius));
}

static void test_drive_by_radius(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(137, 255, 56, 1, 244); /* the manual's example: -200 mm/s on a radius of 500 mm */
    assert_speed(-200 * (1 + 129.0 / 500), -200 * (1 - 129.0 / 500));
    drive(200, -500);
    assert_speed(200 * (1 - 129.0 / 500), 200 * (1 + 129.0 / 500));
    drive(200, 32767);
    assert_speed(200, 200);
    drive(200, -32768);
    assert_speed(200, 200);
    drive(200, 1);
    assert_speed(200, -200);
    drive(200, -1);
    assert_speed(-200, 200);
    drive(100, 3000); /* no larger radius than 2000 */
    assert_speed(100 * (1 + 129.0 / 2000), 100 * (1 - 129.0 / 2000));
}

static void test_the_outer_wheel_has_a_limit(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    drive(500, 129); /* about the left wheel */
    assert_speed(500, 0);
    drive(-9000, 32767);
    assert_speed(-500, -500);
}

static void test_drive_direct_right_comes_first(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, HIGH(-17), LOW(-17), 0, 17);
    assert_speed(-17, 17);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, HIGH(900), LOW(900), HIGH(-900), LOW(-900));
    assert_speed(500, -500);
}

static void test_requested_speeds(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    drive(-200, 500);
    assert_int_equal(ask(CREATE_OI_REQUESTED_VELOCITY, 1), -200);
    assert_int_equal(ask(CREATE_OI_REQUESTED_RADIUS, 1), 500);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, HIGH(-17), LOW(-17), 0, 18);
    assert_int_equal(ask(CREATE_OI_REQUESTED_RIGHT, 1), -17);
    assert_int_equal(ask(CREATE_OI_REQUESTED_LEFT, 1), 18);
    assert_int_equal(ask(CREATE_OI_REQUESTED_VELOCITY, 1), 0);
}

static void test_create_2_turns_its_wheels_in_steps(void **state)
{
    (void)state;
    ready(CREATE_OI_V3, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 14, HIGH(-15), LOW(-15));
    assert_speed(0, -28.5);
    assert_int_equal(ask(CREATE_OI_REQUESTED_RIGHT, 1), 14);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 100, 0, 99);
    assert_speed(114, 85.5); /* 99.75 lies between the steps */
}

static void test_pwm_is_create_2s(void **state)
{
    (void)state;
    ready(CREATE_OI_V3, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_DRIVE_PWM, 0, 255, HIGH(-300), LOW(-300));
    assert_speed(513, -513); /* the step next to 500 */
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_DRIVE_PWM, 0, 0, 0, 0);
    assert_speed(0, 0);
    assert_int_equal(robot.create->reader.count, 0);
}

static void test_speed_of_the_body(void **state)
{
    (void)state;
    double v, omega;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 200, 0, 100);
    sim_create_speed(robot.create, &v, &omega);
    assert_near(v, 0.15, 1e-6);
    assert_near(omega, 0.1 / 0.258, 1e-6);
}

static void test_an_incomplete_command_waits(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 100);
    pass_ticks(5000);
    assert_speed(0, 0);
    SEND(CREATE_OI_OP_START); /* an argument now */
    SEND(0);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_SAFE);
    assert_speed(100, -500);
}

/* Argument bytes of every opcode, from the interface's table: a whole command leaves nothing waiting. */
static void test_length_of_every_command(void **state)
{
    (void)state;
    static const struct {
        uint8_t code;
        int arguments, versions;
    } ALL[] = {
#define ONE(code, name, arguments, versions) {code, arguments, versions},
        CREATE_OI_OPCODES(ONE)
#undef ONE
    };
    for (size_t i = 0; i < sizeof ALL / sizeof ALL[0]; i++) {
        for (int version = CREATE_OI_V2; version <= CREATE_OI_V3; version++) {
            if (!(ALL[i].versions & version))
                continue;
            size_t more = ALL[i].arguments == CREATE_OI_COUNTED ? 4
                          : ALL[i].arguments == CREATE_OI_SONG  ? 8
                                                                : (size_t)ALL[i].arguments;
            uint8_t command[16] = {ALL[i].code, 3, 3};
            switch_on(version);
            sim_create_receive(robot.create, command, more);
            assert_int_equal(robot.create->reader.count, more);
            sim_create_receive(robot.create, command + more, 1);
            assert_int_equal(robot.create->reader.count, 0);
        }
    }
}

static void test_unknown_bytes_are_skipped(void **state)
{
    (void)state;
    switch_on(CREATE_OI_V2);
    SEND(0, 1, 6, 127, 159, 255, CREATE_OI_OP_START, 146, CREATE_OI_OP_SAFE);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_SAFE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_drive_by_radius),
        cmocka_unit_test(test_the_outer_wheel_has_a_limit),
        cmocka_unit_test(test_drive_direct_right_comes_first),
        cmocka_unit_test(test_requested_speeds),
        cmocka_unit_test(test_create_2_turns_its_wheels_in_steps),
        cmocka_unit_test(test_pwm_is_create_2s),
        cmocka_unit_test(test_speed_of_the_body),
        cmocka_unit_test(test_an_incomplete_command_waits),
        cmocka_unit_test(test_length_of_every_command),
        cmocka_unit_test(test_unknown_bytes_are_skipped),
    };
    return cmocka_run_group_tests(tests, NULL, end_robot);
}
