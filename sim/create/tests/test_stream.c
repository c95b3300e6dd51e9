/* The stream, the line's pace, and its faults. */
#include "robot.h"

/* Frames with a right sum at the front of what was heard, each of this length; the rest is left. */
static size_t sound_frames(size_t length)
{
    size_t frames = 0;
    for (const uint8_t *at = robot.heard; at + length <= robot.heard + robot.count; at += length, frames++) {
        uint8_t sum = 0;
        for (size_t i = 0; i < length; i++)
            sum = (uint8_t)(sum + at[i]);
        if (at[0] != CREATE_OI_STREAM_HEADER || at[1] != length - CREATE_OI_STREAM_OVERHEAD || sum != 0)
            break;
    }
    return frames;
}

static void test_a_frame_every_15_ms(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_STREAM, 2, CREATE_OI_CLIFF_FRONT_LEFT_SIGNAL, CREATE_OI_VIRTUAL_WALL);
    pass_ticks(TICKS_PER_S - 1); /* the frame that is due with the next tick is left out */
    const uint8_t expected[] = {19, 5, 29, HIGH(1200), LOW(1200), 13, 0, (uint8_t) - (19 + 5 + 29 + 4 + 176 + 13)};
    assert_memory_equal(robot.heard, expected, sizeof expected);
    assert_int_equal(robot.count, 66 * sizeof expected);
    assert_int_equal(sound_frames(sizeof expected), 66);
}

static void test_pause_and_resume(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_STREAM, 1, CREATE_OI_MODE, CREATE_OI_OP_STREAM_STATE, 0);
    pass_periods(10);
    assert_int_equal(robot.count, 0);
    SEND(CREATE_OI_OP_STREAM_STATE, 1);
    pass_ticks(3 * PERIOD_TICKS - 1);
    assert_int_equal(robot.count, 2 * 5);
    SEND(CREATE_OI_OP_STREAM, 0);
    pass_periods(1);
    forget();
    pass_periods(3);
    assert_int_equal(robot.count, 0);
}

static void test_groups_may_be_streamed(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    SEND(CREATE_OI_OP_STREAM, 1, 6);
    pass_periods(4);
    assert_int_equal(sound_frames(52 + 1 + CREATE_OI_STREAM_OVERHEAD), 3);
    assert_int_equal(robot.heard[2], 6);
}

/* A frame of 86 bytes fits the 15 ms of a Create 1, one of 88 does not: it is cut off by the next. Twice as much fits a
 * Create 2. */
static void test_budget(void **state)
{
    (void)state;
    enum { PACKETS_86 = 41, PACKETS_88 = 42 };
    uint8_t command[2 + PACKETS_88] = {CREATE_OI_OP_STREAM, PACKETS_86};
    memset(command + 2, CREATE_OI_MODE, PACKETS_88);
    command[2] = CREATE_OI_DISTANCE;
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
    sim_create_receive(robot.create, command, 2 + PACKETS_86);
    pass_periods(20);
    assert_int_equal(sound_frames(86), 19);
    command[1] = PACKETS_88;
    for (int version = CREATE_OI_V2; version <= CREATE_OI_V3; version++) {
        ready(version, CREATE_OI_OP_SAFE);
        sim_create_receive(robot.create, command, sizeof command);
        pass_periods(20);
        assert_int_equal(sound_frames(88), version == CREATE_OI_V3 ? 19 : 0);
    }
}

static void test_pace_of_the_line(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_START);
    SEND(CREATE_OI_OP_SENSORS, 6);
    pass_ticks(10);
    assert_in_range(robot.count, 28, 29); /* 5 ms at 5760 bytes a second */
    pass_periods(2);
    assert_int_equal(robot.count, 52);
    SEND(CREATE_OI_OP_BAUD, 4); /* 4800 baud, 100 ms later */
    pass_ticks(200);
    forget();
    SEND(CREATE_OI_OP_SENSORS, 6);
    pass_ticks(100);
    assert_in_range(robot.count, 24, 25);
    SEND(CREATE_OI_OP_BAUD, 12); /* there is none */
    pass_ticks(200);
    assert_int_equal(robot.create->line.baud, 4800);
}

static void stream_under(struct sim_create_options options)
{
    switch_on_with(options);
    SEND(CREATE_OI_OP_START, CREATE_OI_OP_STREAM, 4, CREATE_OI_MODE, CREATE_OI_VOLTAGE, CREATE_OI_DISTANCE,
         CREATE_OI_ANGLE);
    pass_ticks(20 * TICKS_PER_S - 1);
}

static uint8_t clean[HEARD_MAX];

static size_t hear_clean(void)
{
    stream_under(sim_create_defaults(CREATE_OI_V2));
    memcpy(clean, robot.heard, robot.count);
    return robot.count;
}

static void test_lost_and_extra_bytes(void **state)
{
    (void)state;
    const size_t all = hear_clean();
    struct sim_create_options losing = sim_create_defaults(CREATE_OI_V2), adding = losing;
    losing.lose = adding.extra = 0.02;
    stream_under(losing);
    assert_in_range(robot.count, (size_t)(0.975 * (double)all), (size_t)(0.985 * (double)all));
    stream_under(adding);
    assert_in_range(robot.count, (size_t)(1.015 * (double)all), (size_t)(1.025 * (double)all));
}

static void test_flipped_bits(void **state)
{
    (void)state;
    size_t all = hear_clean(), wrong = 0;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.flip = 0.02;
    stream_under(options);
    assert_int_equal(robot.count, all);
    for (size_t i = 0; i < all; i++) {
        unsigned bits = robot.heard[i] ^ clean[i];
        assert_int_equal(bits & (bits - 1), 0); /* one at most */
        wrong += bits != 0;
    }
    assert_in_range(wrong, (size_t)(0.015 * (double)all), (size_t)(0.025 * (double)all));
}

static void test_same_seed_same_faults(void **state)
{
    (void)state;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.lose = options.flip = options.extra = 0.01;
    stream_under(options);
    size_t count = robot.count;
    memcpy(clean, robot.heard, count);
    stream_under(options);
    assert_int_equal(robot.count, count);
    assert_memory_equal(robot.heard, clean, count);
    options.seed = 2;
    stream_under(options);
    assert_true(robot.count != count || memcmp(robot.heard, clean, count) != 0);
}

static void test_lost_orders(void **state)
{
    (void)state;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.lose_orders = 0.5;
    switch_on_with(options);
    size_t obeyed = 0;
    for (int i = 0; i < 1000; i++) {
        create_set_mode(robot.create, CREATE_OI_MODE_OFF);
        SEND(CREATE_OI_OP_START);
        obeyed += sim_create_mode(robot.create) == CREATE_OI_MODE_PASSIVE;
    }
    assert_in_range(obeyed, 440, 560);
}

static void test_silence(void **state)
{
    (void)state;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.events = 1;
    options.event[0] = (struct sim_create_event){SIM_CREATE_SILENT, 1, 2};
    switch_on_with(options);
    SEND(CREATE_OI_OP_START, CREATE_OI_OP_STREAM, 1, CREATE_OI_MODE);
    pass_ticks(TICKS_PER_S);
    forget();
    pass_ticks(TICKS_PER_S);
    SEND(CREATE_OI_OP_SAFE);
    pass_ticks(TICKS_PER_S - 2);
    assert_int_equal(robot.count, 0);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_PASSIVE);
    pass_ticks(TICKS_PER_S);
    assert_true(robot.count > 300);
}

/* Each fault at its place of the line: what comes differs from a sound line's there alone. */
static void test_faults_at_their_places(void **state)
{
    (void)state;
    static const struct {
        struct sim_create_fault fault;
        int more;
    } cases[] = {{{SIM_CREATE_LOSE, 500, 3, 0, 0}, -3},
                 {{SIM_CREATE_FLIP, 500, 2, 0x21, 0}, 0},
                 {{SIM_CREATE_TWICE, 500, 40, 0, 0}, 40},
                 {{SIM_CREATE_LIE, 30, 1, -2, CREATE_OI_DISTANCE}, 0}};
    const size_t all = hear_clean();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
        options.faults = 1;
        options.fault[0] = cases[i].fault;
        stream_under(options);
        const size_t place = i == 3 ? 0 : 500;
        assert_int_equal(robot.count, (int)all + cases[i].more);
        assert_memory_equal(robot.heard, clean, place);
        if (i == 1)
            assert_int_equal(robot.heard[501], clean[501] ^ 0x21);
        if (i == 2)
            assert_memory_equal(robot.heard + 540, clean + 500, all - 500);
        if (i == 3)
            assert_int_equal(sound_frames(14), (20 * TICKS_PER_S - 1) / PERIOD_TICKS); /* with a right sum */
    }
}

static void test_orders_wait_in_the_hosts_adapter(void **state)
{
    (void)state;
    static uint8_t orders[2 * SIM_CREATE_IN_MAX]; /* bytes that mean nothing */
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.queue = true;
    switch_on_with(options);
    assert_int_equal(sim_create_receive(robot.create, orders, sizeof orders), SIM_CREATE_IN_MAX);
    assert_int_equal(sim_create_receive(robot.create, orders, 1), 0);
    pass_ticks(TICKS_PER_S / 10);
    assert_in_range(sim_create_queued(robot.create), SIM_CREATE_IN_MAX - 576, SIM_CREATE_IN_MAX - 574);
    sim_create_flush(robot.create);
    SEND(CREATE_OI_OP_START);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_OFF);
    pass_ticks(2);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_PASSIVE);
}

static void wait_for(uint32_t stimuli, double start_s, double length_s)
{
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.events = 1;
    options.event[0] = (struct sim_create_event){stimuli, start_s, length_s};
    switch_on_with(options);
    SEND(CREATE_OI_OP_START, CREATE_OI_OP_STREAM, 1, CREATE_OI_MODE);
}

static void test_one_wire_of_two_is_cut(void **state)
{
    (void)state;
    wait_for(SIM_CREATE_MUTE, 0, 9);
    pass_ticks(TICKS_PER_S / 2);
    SEND(CREATE_OI_OP_SAFE);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_SAFE);
    assert_int_equal(robot.count, 0);
    wait_for(SIM_CREATE_DEAF, 0.1, 9);
    pass_ticks(TICKS_PER_S / 2);
    SEND(CREATE_OI_OP_SAFE);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_PASSIVE);
    assert_true(robot.count > 30 * 5);
}

static void test_an_adapter_that_holds_bytes_gives_them_all(void **state)
{
    (void)state;
    wait_for(SIM_CREATE_HELD, 0.1, 0.3);
    pass_ticks(TICKS_PER_S / 5);
    const size_t held = robot.count;
    pass_ticks(TICKS_PER_S / 10);
    assert_int_equal(robot.count, held);
    pass_ticks(TICKS_PER_S / 5);
    assert_in_range(sound_frames(5), 31, 33);
}

static void test_power_that_comes_back_is_told_in_text(void **state)
{
    (void)state;
    wait_for(SIM_CREATE_RESTART, 0.1, 0.1);
    pass_ticks(TICKS_PER_S / 5 - 1);
    forget();
    pass_ticks(TICKS_PER_S / 10);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_OFF);
    assert_true(robot.count > 10);
    assert_non_null(memmem(robot.heard, robot.count, "boot", 4));
}

static void test_it_sleeps_after_minutes_without_an_order(void **state)
{
    (void)state;
    wait_for(SIM_CREATE_WAKE, CREATE_OI_SLEEP_S + 2, 0.5);
    for (int second = 0; second < CREATE_OI_SLEEP_S; second++) {
        assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_PASSIVE);
        pass_ticks(TICKS_PER_S);
        forget();
    }
    pass_ticks(TICKS_PER_S);
    SEND(CREATE_OI_OP_START);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_OFF);
    pass_ticks(2 * TICKS_PER_S);
    SEND(CREATE_OI_OP_START);
    assert_int_equal(sim_create_mode(robot.create), CREATE_OI_MODE_PASSIVE);
}

static void test_a_charger_is_told_in_text_while_it_is_off(void **state)
{
    (void)state;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    options.events = 1;
    options.event[0] = (struct sim_create_event){SIM_CREATE_CHARGER, 0, 9};
    switch_on_with(options);
    pass_ticks(TICKS_PER_S + TICKS_PER_S / 2);
    assert_non_null(memmem(robot.heard, robot.count, " mV, 1250 mA\r\n", 14));
}

static void test_nobody_takes_the_bytes(void **state)
{
    (void)state;
    ready(CREATE_OI_V2, CREATE_OI_OP_START);
    SEND(CREATE_OI_OP_STREAM, 1, 6);
    for (int i = 0; i < 10 * TICKS_PER_S; i++)
        sim_create_tick(robot.create, &robot.motion);
    assert_int_equal(sim_create_take(robot.create, robot.heard, HEARD_MAX), SIM_CREATE_OUT_MAX);
    assert_int_equal(sim_create_take(robot.create, robot.heard, HEARD_MAX), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_frame_every_15_ms),
        cmocka_unit_test(test_pause_and_resume),
        cmocka_unit_test(test_groups_may_be_streamed),
        cmocka_unit_test(test_budget),
        cmocka_unit_test(test_pace_of_the_line),
        cmocka_unit_test(test_lost_and_extra_bytes),
        cmocka_unit_test(test_flipped_bits),
        cmocka_unit_test(test_same_seed_same_faults),
        cmocka_unit_test(test_lost_orders),
        cmocka_unit_test(test_silence),
        cmocka_unit_test(test_faults_at_their_places),
        cmocka_unit_test(test_orders_wait_in_the_hosts_adapter),
        cmocka_unit_test(test_one_wire_of_two_is_cut),
        cmocka_unit_test(test_an_adapter_that_holds_bytes_gives_them_all),
        cmocka_unit_test(test_power_that_comes_back_is_told_in_text),
        cmocka_unit_test(test_it_sleeps_after_minutes_without_an_order),
        cmocka_unit_test(test_a_charger_is_told_in_text_while_it_is_off),
        cmocka_unit_test(test_nobody_takes_the_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, end_robot);
}
