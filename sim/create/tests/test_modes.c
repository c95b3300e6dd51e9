/* Modes: what leads to which, and what each allows. */
#include "robot.h"

#define assert_mode(expected) assert_int_equal(sim_create_mode(robot.create), expected)

static void test_off_obeys_start_alone(void **state)
{
    (void)state;
    switch_on(CREATE_OI_V2);
    SEND(CREATE_OI_OP_SAFE, CREATE_OI_OP_FULL, CREATE_OI_OP_SENSORS, 35);
    pass_periods(2);
    assert_mode(CREATE_OI_MODE_OFF);
    assert_int_equal(robot.count, 0);
    SEND(CREATE_OI_OP_START);
    assert_mode(CREATE_OI_MODE_PASSIVE);
}

static void test_each_mode_command(void **state)
{
    (void)state;
    static const struct {
        int version;
        uint8_t opcode;
        enum create_oi_mode mode;
    } CASES[] = {
        {CREATE_OI_V2, CREATE_OI_OP_START, CREATE_OI_MODE_PASSIVE},
        {CREATE_OI_V2, CREATE_OI_OP_CONTROL, CREATE_OI_MODE_SAFE},
        {CREATE_OI_V2, CREATE_OI_OP_SAFE, CREATE_OI_MODE_SAFE},
        {CREATE_OI_V2, CREATE_OI_OP_FULL, CREATE_OI_MODE_FULL},
        {CREATE_OI_V2, CREATE_OI_OP_SPOT, CREATE_OI_MODE_PASSIVE},
        {CREATE_OI_V2, CREATE_OI_OP_COVER, CREATE_OI_MODE_PASSIVE},
        {CREATE_OI_V2, CREATE_OI_OP_DOCK, CREATE_OI_MODE_PASSIVE},
        {CREATE_OI_V2, CREATE_OI_OP_RESET, CREATE_OI_MODE_FULL}, /* these three not before version 3 */
        {CREATE_OI_V2, CREATE_OI_OP_POWER, CREATE_OI_MODE_FULL},
        {CREATE_OI_V2, CREATE_OI_OP_STOP, CREATE_OI_MODE_FULL},
        {CREATE_OI_V3, CREATE_OI_OP_SAFE, CREATE_OI_MODE_SAFE},
        {CREATE_OI_V3, CREATE_OI_OP_RESET, CREATE_OI_MODE_OFF},
        {CREATE_OI_V3, CREATE_OI_OP_POWER, CREATE_OI_MODE_PASSIVE},
        {CREATE_OI_V3, CREATE_OI_OP_STOP, CREATE_OI_MODE_OFF},
        {CREATE_OI_V3, CREATE_OI_OP_MAX_CLEAN, CREATE_OI_MODE_PASSIVE},
    };
    for (size_t i = 0; i < sizeof CASES / sizeof CASES[0]; i++) {
        ready(CASES[i].version, CREATE_OI_OP_FULL);
        SEND(CASES[i].opcode);
        assert_mode(CASES[i].mode);
    }
}

static void test_demo_takes_its_number(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_FULL);
    SEND(CREATE_OI_OP_DEMO);
    assert_mode(CREATE_OI_MODE_FULL);
    SEND(CREATE_OI_OP_FULL); /* the demo's number, no command */
    assert_mode(CREATE_OI_MODE_PASSIVE);
}

static void test_wheels_turn_in_safe_and_full_only(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_START);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 100, 0, 50);
    assert_speed(0, 0);
    SEND(CREATE_OI_OP_SAFE, CREATE_OI_OP_DRIVE_DIRECT, 0, 100, 0, 50);
    assert_speed(100, 50);
    SEND(CREATE_OI_OP_FULL);
    assert_speed(100, 50);
    SEND(CREATE_OI_OP_START);
    assert_speed(0, 0);
    assert_int_equal(ask(CREATE_OI_REQUESTED_RIGHT, 1), 0);
}

/* What happens to a robot in this mode with these wheel speeds when a stimulus comes. */
static enum create_oi_mode after(uint8_t mode, int right, int left, uint32_t stimuli)
{
    ready(CREATE_OI_V2, mode);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, HIGH(right), LOW(right), HIGH(left), LOW(left));
    robot.motion.stimuli = stimuli;
    pass_ticks(1);
    return sim_create_mode(robot.create);
}

static void test_safe_falls_back_to_passive(void **state)
{
    (void)state;
    const uint8_t safe = CREATE_OI_OP_SAFE;
    for (uint32_t cliff = SIM_CREATE_CLIFF_LEFT; cliff <= SIM_CREATE_CLIFF_RIGHT; cliff <<= 1)
        assert_int_equal(after(safe, 100, 100, cliff), CREATE_OI_MODE_PASSIVE);
    assert_speed(0, 0);
    assert_int_equal(after(safe, -100, -100, SIM_CREATE_CLIFF_LEFT), CREATE_OI_MODE_SAFE);
    assert_int_equal(after(safe, -100, -80, SIM_CREATE_CLIFF_LEFT), CREATE_OI_MODE_SAFE);   /* radius 1.16 m */
    assert_int_equal(after(safe, -100, 20, SIM_CREATE_CLIFF_LEFT), CREATE_OI_MODE_PASSIVE); /* 0.086 m */
    assert_int_equal(after(safe, 100, -100, SIM_CREATE_CLIFF_LEFT), CREATE_OI_MODE_PASSIVE);
    assert_int_equal(after(safe, 0, 0, SIM_CREATE_CLIFF_LEFT), CREATE_OI_MODE_SAFE);
    for (uint32_t drop = SIM_CREATE_DROP_RIGHT; drop <= SIM_CREATE_DROP_CASTER; drop <<= 1)
        assert_int_equal(after(safe, 0, 0, drop), CREATE_OI_MODE_PASSIVE);
    assert_int_equal(after(safe, 0, 0, SIM_CREATE_CHARGER), CREATE_OI_MODE_PASSIVE);
    assert_int_equal(after(safe, 100, 100, SIM_CREATE_BUMP_LEFT | SIM_CREATE_VIRTUAL_WALL), CREATE_OI_MODE_SAFE);
}

static void test_full_goes_on(void **state)
{
    (void)state;
    const uint32_t all = SIM_CREATE_CLIFF_LEFT | SIM_CREATE_DROP_LEFT | SIM_CREATE_CHARGER;
    assert_int_equal(after(CREATE_OI_OP_FULL, 100, 100, all), CREATE_OI_MODE_FULL);
    assert_speed(100, 100);
}

static void test_an_empty_battery_switches_off(void **state)
{
    (void)state;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.battery_low = true;
    switch_on_with(options);
    SEND(CREATE_OI_OP_START);
    robot.create->charge_mah = 1e-4;
    pass_ticks(4);
    assert_mode(CREATE_OI_MODE_OFF);
    SEND(CREATE_OI_OP_START);
    assert_mode(CREATE_OI_MODE_OFF);
    robot.motion.stimuli = SIM_CREATE_CHARGER;
    pass_ticks(4);
    SEND(CREATE_OI_OP_START);
    assert_mode(CREATE_OI_MODE_PASSIVE);
}

/* Each is followed by another order; their last arguments are opcodes themselves. */
static void test_songs_scripts_and_waits_are_read_whole_and_do_nothing(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_SONG, 3, 2, 60, 32, 70, CREATE_OI_OP_STOP, CREATE_OI_OP_PLAY, 3);
    SEND(CREATE_OI_OP_SCRIPT, 5, CREATE_OI_OP_DRIVE_DIRECT, 0, 200, 0, CREATE_OI_OP_START);
    SEND(CREATE_OI_OP_PLAY_SCRIPT, CREATE_OI_OP_SHOW_SCRIPT, CREATE_OI_OP_WAIT_TIME, CREATE_OI_OP_START);
    SEND(CREATE_OI_OP_WAIT_DISTANCE, 0, CREATE_OI_OP_START, CREATE_OI_OP_WAIT_ANGLE, 0, CREATE_OI_OP_START);
    SEND(CREATE_OI_OP_WAIT_EVENT, CREATE_OI_OP_START);
    pass_periods(2);
    assert_int_equal(robot.count, 0);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_SAFE);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 100, 0, 50);
    assert_speed(100, 50);
}

static void test_create_2_has_no_scripts(void **state)
{
    (void)state;
    ready(CREATE_OI_V3, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_WAIT_TIME, CREATE_OI_OP_FULL);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_FULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_off_obeys_start_alone),
        cmocka_unit_test(test_each_mode_command),
        cmocka_unit_test(test_demo_takes_its_number),
        cmocka_unit_test(test_wheels_turn_in_safe_and_full_only),
        cmocka_unit_test(test_safe_falls_back_to_passive),
        cmocka_unit_test(test_full_goes_on),
        cmocka_unit_test(test_an_empty_battery_switches_off),
        cmocka_unit_test(test_songs_scripts_and_waits_are_read_whole_and_do_nothing),
        cmocka_unit_test(test_create_2_has_no_scripts),
    };
    return cmocka_run_group_tests(tests, NULL, end_robot);
}
