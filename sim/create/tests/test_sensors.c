/* What packets and groups hold. */
#include "robot.h"

static size_t ask_for(uint8_t id)
{
    pass_periods(1);
    forget();
    SEND(CREATE_OI_OP_SENSORS, id);
    pass_ticks(PERIOD_TICKS - 1);
    return robot.count;
}

static void test_length_of_every_packet_and_group(void **state)
{
    (void)state;
    static const struct {
        uint8_t id;
        size_t bytes;
        int versions;
    } ALL[] = {
#define PACKET(id, name, bytes, is_signed, unit, versions) {id, bytes, versions},
        CREATE_OI_PACKETS(PACKET)
#undef PACKET
#define GROUP(id, first, last, bytes, versions) {id, bytes, versions},
            CREATE_OI_GROUPS(GROUP)
#undef GROUP
    };
    for (int version = CREATE_OI_V2; version <= CREATE_OI_V3; version++) {
        ready(version, CREATE_OI_OP_START);
        for (size_t i = 0; i < sizeof ALL / sizeof ALL[0]; i++)
            assert_int_equal(ask_for(ALL[i].id), ALL[i].versions & version ? ALL[i].bytes : 0);
        assert_int_equal(ask_for(59), 0);
        assert_int_equal(ask_for(255), 0);
    }
}

static void test_query_list(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 30, HIGH(-30), LOW(-30));
    pass_periods(1);
    forget();
    SEND(CREATE_OI_OP_QUERY_LIST, 3, CREATE_OI_REQUESTED_LEFT, CREATE_OI_MODE, CREATE_OI_REQUESTED_RIGHT);
    pass_periods(1);
    const uint8_t expected[] = {0xFF, 0xE2, CREATE_OI_MODE_SAFE, 0, 30};
    assert_int_equal(robot.count, sizeof expected);
    assert_memory_equal(robot.heard, expected, sizeof expected);
}

static void test_bumps_and_drops(void **state)
{
    (void)state;
    for (int bit = 0; bit < 5; bit++) {
        ready(CREATE_OI_V2, CREATE_OI_OP_FULL);
        robot.motion.stimuli = 1u << bit;
        assert_int_equal(ask(CREATE_OI_BUMPS_DROPS, 0), 1 << bit);
        robot.motion.stimuli = 0;
        assert_int_equal(ask(CREATE_OI_BUMPS_DROPS, 0), 0);
    }
    ready(CREATE_OI_V3, CREATE_OI_OP_FULL);
    robot.motion.stimuli = SIM_CREATE_DROP_CASTER | SIM_CREATE_BUMP_LEFT;
    assert_int_equal(ask(CREATE_OI_BUMPS_DROPS, 0), CREATE_OI_BUMP_LEFT);
}

static void test_cliffs(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_FULL);
    for (uint8_t i = 0; i < 4; i++) {
        robot.motion.stimuli = (uint32_t)SIM_CREATE_CLIFF_LEFT << i;
        for (uint8_t j = 0; j < 4; j++) {
            assert_int_equal(ask((uint8_t)(CREATE_OI_CLIFF_LEFT + j), 0), i == j);
            int level = ask((uint8_t)(CREATE_OI_CLIFF_LEFT_SIGNAL + j), 0);
            assert_true(i == j ? level < 100 : level > 1000);
        }
    }
}

static void test_virtual_wall_and_charger(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_FULL);
    assert_int_equal(ask(CREATE_OI_INFRARED, 0), 255);
    assert_int_equal(ask(CREATE_OI_CHARGING_STATE, 0), 0);
    robot.motion.stimuli = SIM_CREATE_VIRTUAL_WALL | SIM_CREATE_CHARGER;
    assert_int_equal(ask(CREATE_OI_VIRTUAL_WALL, 0), 1);
    assert_int_equal(ask(CREATE_OI_INFRARED, 0), 162);
    assert_int_equal(ask(CREATE_OI_CHARGING_STATE, 0), 2);
    assert_int_equal(ask(CREATE_OI_CHARGING_SOURCES, 0), CREATE_OI_CHARGER_INTERNAL);
    assert_true(ask(CREATE_OI_CURRENT, 1) > 0);
}

/* Half a degree and 0.6 mm between readings: what is below a unit adds up, or never shows. */
static void read_in_small_steps(bool drop, int *millimetres, int *degrees)
{
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.drop_remainder = drop;
    switch_on_with(options);
    SEND(CREATE_OI_OP_START);
    *millimetres = *degrees = 0;
    for (int i = 0; i < 100; i++) {
        robot.motion.distance_m += 0.3e-3;
        robot.motion.angle_rad -= 0.25 * M_PI / 180;
        *millimetres += ask(CREATE_OI_DISTANCE, 1);
        robot.motion.distance_m += 0.3e-3;
        robot.motion.angle_rad -= 0.25 * M_PI / 180;
        *degrees += ask(CREATE_OI_ANGLE, 1);
    }
}

static void test_remainders_kept_or_dropped(void **state)
{
    (void)state;
    int millimetres, degrees;
    read_in_small_steps(false, &millimetres, &degrees);
    assert_in_range(millimetres, 59, 60);
    assert_in_range(-degrees, 49, 50);
    read_in_small_steps(true, &millimetres, &degrees);
    assert_int_equal(millimetres, 0);
    assert_int_equal(degrees, 0);
}

static void test_distance_counts_from_its_last_reading(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_START);
    robot.motion = (struct sim_create_motion){.distance_m = 0.5, .angle_rad = -M_PI / 2};
    assert_int_equal(ask(CREATE_OI_DISTANCE, 1), 500);
    assert_int_equal(ask(CREATE_OI_DISTANCE, 1), 0);
    assert_int_equal(ask(CREATE_OI_ANGLE, 1), -90);
    robot.motion.distance_m += 40; /* more than 16 bits */
    assert_int_equal(ask(CREATE_OI_DISTANCE, 1), INT16_MAX);
}

static void test_encoders_count_and_wrap(void **state)
{
    (void)state;
    const double mm_per_count = M_PI * 72.0 / 508.8;
    ready(CREATE_OI_V3, CREATE_OI_OP_START);
    robot.motion.distance_m = 1000.5 * mm_per_count / 1000;
    assert_int_equal(ask(CREATE_OI_ENCODER_LEFT, 1), 1000);
    robot.motion.angle_rad = M_PI / 2; /* each wheel a quarter of its circle of 235 mm */
    int apart = (int)floor(M_PI / 2 * 117.5 / mm_per_count + 1000.5);
    assert_int_equal(ask(CREATE_OI_ENCODER_RIGHT, 1), apart);
    assert_int_equal(ask(CREATE_OI_ENCODER_LEFT, 1), (int)floor(1000.5 - M_PI / 2 * 117.5 / mm_per_count));
    robot.motion = (struct sim_create_motion){.distance_m = 32768.5 * mm_per_count / 1000};
    assert_int_equal(ask(CREATE_OI_ENCODER_RIGHT, 1), -32768);
    robot.motion.distance_m = -0.5 * mm_per_count / 1000;
    assert_int_equal(ask(CREATE_OI_ENCODER_RIGHT, 1), -1);
}

static void test_battery(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_FULL);
    int idle = ask(CREATE_OI_CURRENT, 1), voltage = ask(CREATE_OI_VOLTAGE, 0);
    SEND(CREATE_OI_OP_DRIVE, 1, 0, 0x7F, 0xFF);
    assert_true(ask(CREATE_OI_CURRENT, 1) < idle && idle < 0);
    int charge = ask(CREATE_OI_CHARGE, 0);
    pass_ticks(60 * TICKS_PER_S);
    assert_in_range(charge - ask(CREATE_OI_CHARGE, 0), 8, 11); /* a minute at 557 mA is 9.3 mAh */
    assert_true(ask(CREATE_OI_CHARGE, 0) < ask(CREATE_OI_CAPACITY, 0));
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.battery_low = true;
    switch_on_with(options);
    SEND(CREATE_OI_OP_START);
    assert_true(ask(CREATE_OI_VOLTAGE, 0) < voltage - 3000);
}

static void test_old_firmware(void **state)
{
    (void)state;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V3);
    options.angle_factor = CREATE_OI_V3_OLD_ANGLE_UNIT;
    options.distance_factor = 0.5;
    options.mode_plus_one = true;
    switch_on_with(options);
    SEND(CREATE_OI_OP_START, CREATE_OI_OP_FULL, CREATE_OI_OP_DRIVE, 0, 0, 1, 0);
    robot.motion = (struct sim_create_motion){.distance_m = 1, .angle_rad = M_PI};
    assert_int_equal(ask(CREATE_OI_ANGLE, 1), 58); /* 180 degrees times 0.324056 */
    assert_int_equal(ask(CREATE_OI_DISTANCE, 1), 500);
    assert_int_equal(ask(CREATE_OI_REQUESTED_RADIUS, 1), 128);
    assert_int_equal(ask(CREATE_OI_MODE, 0), 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_length_of_every_packet_and_group),
        cmocka_unit_test(test_query_list),
        cmocka_unit_test(test_bumps_and_drops),
        cmocka_unit_test(test_cliffs),
        cmocka_unit_test(test_virtual_wall_and_charger),
        cmocka_unit_test(test_remainders_kept_or_dropped),
        cmocka_unit_test(test_distance_counts_from_its_last_reading),
        cmocka_unit_test(test_encoders_count_and_wrap),
        cmocka_unit_test(test_battery),
        cmocka_unit_test(test_old_firmware),
    };
    return cmocka_run_group_tests(tests, NULL, end_robot);
}
