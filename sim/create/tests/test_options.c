/* Options by name, and stimuli that come by themselves. */
#include "robot.h"

static char error[512];

static int set(struct sim_create_options *options, const char *name, const char *value)
{
    return sim_create_set(options, name, value, error, sizeof error);
}

static void test_every_option_is_taken(void **state)
{
    (void)state;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V3);
    assert_int_equal(set(&options, "drop-remainder", NULL), 0);
    assert_int_equal(set(&options, "battery-low", NULL), 0);
    assert_int_equal(set(&options, "mode-plus-one", NULL), 0);
    assert_int_equal(set(&options, "old-angle", NULL), 0);
    assert_int_equal(set(&options, "old-distance", "0.25"), 0);
    assert_int_equal(set(&options, "lose-bytes", "0.001"), 0);
    assert_int_equal(set(&options, "flip-bytes", "0.002"), 0);
    assert_int_equal(set(&options, "extra-bytes", "0.003"), 0);
    assert_int_equal(set(&options, "lose-orders", "0.004"), 0);
    assert_int_equal(set(&options, "event", "bump-left@3s"), 0);
    assert_int_equal(set(&options, "event", "silent@10+2.5"), 0);
    assert_true(options.drop_remainder && options.battery_low && options.mode_plus_one);
    assert_near(options.angle_factor, 0.324056, 1e-9);
    assert_near(options.distance_factor, 0.25, 1e-9);
    assert_near(options.lose + 10 * options.flip + 100 * options.extra + 1000 * options.lose_orders, 4.321, 1e-6);
    assert_int_equal(options.events, 2);
    assert_int_equal(options.event[0].stimuli, SIM_CREATE_BUMP_LEFT);
    assert_near(options.event[0].start_s, 3, 1e-9);
    assert_near(options.event[0].length_s, 0.5, 1e-9);
    assert_int_equal(options.event[1].stimuli, SIM_CREATE_SILENT);
    assert_near(options.event[1].length_s, 2.5, 1e-9);
}

static void test_all_are_described(void **state)
{
    (void)state;
    const char *name, *value, *help;
    size_t count = 0;
    while (sim_create_describe(count, &name, &value, &help)) {
        struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
        assert_true(strlen(name) > 0 && strlen(help) > 0);
        assert_int_equal(set(&options, name, value ? "?" : NULL), value ? -1 : 0);
        count++;
    }
    assert_int_equal(count, 11);
}

static void test_what_is_refused(void **state)
{
    (void)state;
    static const char *const WRONG[][2] = {
        {"no-such", NULL},         {"lose-bytes", NULL},   {"lose-bytes", "2"},        {"flip-bytes", "-0.1"},
        {"extra-bytes", "0.1x"},   {"lose-orders", ""},    {"lose-bytes", "nan"},      {"old-distance", "0"},
        {"drop-remainder", "yes"}, {"event", "bump-left"}, {"event", "kick@3"},        {"event", "bump@"},
        {"event", "bump@3s+"},     {"event", "bump@-1"},   {"event", "bump@3s+1s+1s"}, {"event", "bump@3 s"},
        {"queue", "4096"},
    };
    for (size_t i = 0; i < sizeof WRONG / sizeof WRONG[0]; i++) {
        struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
        error[0] = '\0';
        assert_int_equal(set(&options, WRONG[i][0], WRONG[i][1]), -1);
        assert_true(strlen(error) > 0 && !strchr(error, '\n'));
        assert_int_equal(options.events, 0);
    }
}

static void test_too_many_events(void **state)
{
    (void)state;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    for (int i = 0; i < SIM_CREATE_EVENTS_MAX; i++)
        assert_int_equal(set(&options, "event", "bump@1"), 0);
    assert_int_equal(set(&options, "event", "bump@1"), -1);
}

static void test_an_event_comes_and_goes(void **state)
{
    (void)state;
    struct sim_create_options options = sim_create_defaults(CREATE_OI_V2);
    assert_int_equal(set(&options, "event", "bump-right@0.5s+0.25s"), 0);
    switch_on_with(options);
    SEND(CREATE_OI_OP_START);
    pass_ticks(TICKS_PER_S / 2 - 3 * PERIOD_TICKS);
    assert_int_equal(ask(CREATE_OI_BUMPS_DROPS, 0), 0);
    pass_periods(1);
    assert_int_equal(ask(CREATE_OI_BUMPS_DROPS, 0), CREATE_OI_BUMP_RIGHT);
    pass_ticks(TICKS_PER_S / 4);
    assert_int_equal(ask(CREATE_OI_BUMPS_DROPS, 0), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_option_is_taken),   cmocka_unit_test(test_all_are_described),
        cmocka_unit_test(test_what_is_refused),         cmocka_unit_test(test_too_many_events),
        cmocka_unit_test(test_an_event_comes_and_goes),
    };
    return cmocka_run_group_tests(tests, NULL, end_robot);
}
