/* Orders of clients while the base is silent: how far it has driven meanwhile, when it is heard again. */
#include "base_met.h"

#include <math.h>

#define SPEED_MM_S 200
#define FRAME_MM (SPEED_MM_S * CREATE_OI_PERIOD_MS / 1000)
#define FRAME_M (FRAME_MM * 1e-3)
/* Of the test's clock: the port is opened, the last frame before the silence, an order within it, the next frame. */
#define OPENED_MS 1000
#define HEARD_MS (OPENED_MS + 5 * CREATE_OI_PERIOD_MS)
#define ORDERED_MS (HEARD_MS + 200)
#define BACK_MS (HEARD_MS + 1500)

static double driven_m;

static void on_step(void *context, const struct create_step *step, unsigned bits)
{
    base_clients_step(context, step, bits);
    driven_m += step->distance;
}

/* Driving, and then not heard any more. */
static int begin(void **state)
{
    (void)state;
    begin_rig(false, on_step, OPENED_MS);
    meet(OPENED_MS);
    say(commander, "drive 0.2 0", OPENED_MS);
    for (int64_t now_ms = OPENED_MS; now_ms < HEARD_MS; now_ms += CREATE_OI_PERIOD_MS) {
        report_frame(SPEED_MM_S, FRAME_MM, now_ms + CREATE_OI_PERIOD_MS);
    }
    driven_m = 0;
    return 0;
}

/* The first frame after the silence says that the base stands: it drove until `stopped_ms`, to a frame. */
static void assert_driven_until(int64_t stopped_ms)
{
    if (robot.port >= 0) {
        base_robot_read(&robot, UINT64_MAX, BACK_MS - 1); /* there was nothing */
    }
    report_frame(0, 0, BACK_MS);
    const double expected_m = (double)(stopped_ms - HEARD_MS) / CREATE_OI_PERIOD_MS * FRAME_M;
    if (fabs(driven_m - expected_m) > 1.5 * FRAME_M) {
        fail_msg("%.4f m driven, expected %.4f", driven_m, expected_m);
    }
}

static void a_stop_ends_the_motion(void **state)
{
    (void)state;
    say(commander, "stop", ORDERED_MS);
    assert_driven_until(ORDERED_MS);
}

static void a_drive_at_no_speed_ends_the_motion(void **state)
{
    (void)state;
    say(commander, "drive 0 0", ORDERED_MS);
    assert_driven_until(ORDERED_MS);
}

static void another_clients_stop_ends_the_motion(void **state)
{
    (void)state;
    say(other, "stop", ORDERED_MS);
    assert_driven_until(ORDERED_MS);
}

static void a_change_of_mode_ends_the_motion(void **state)
{
    (void)state;
    say(commander, "mode safe", ORDERED_MS);
    assert_driven_until(ORDERED_MS);
}

static void a_commander_that_goes_ends_the_motion(void **state)
{
    (void)state;
    close(commander);
    serve(ORDERED_MS);
    commander = dup(other);
    assert_driven_until(ORDERED_MS);
}

static void the_drivers_own_stops_end_the_motion(void **state)
{
    (void)state;
    base_robot_watch(&robot, OPENED_MS + BASE_COMMANDER_MS);
    assert_int_equal(robot.commander_stops, 1);
    assert_driven_until(OPENED_MS + BASE_COMMANDER_MS);
}

static void a_silence_that_is_noticed_ends_the_motion(void **state)
{
    (void)state;
    say(commander, "drive 0.2 0", HEARD_MS + BASE_SILENCE_MS - 100);
    base_robot_watch(&robot, HEARD_MS + BASE_SILENCE_MS);
    assert_int_equal(robot.silences, 1);
    assert_driven_until(HEARD_MS + BASE_SILENCE_MS);
}

/* The log has just said that they stand: it takes that back as early as without the orders. */
static void a_silence_counts_from_the_last_frame_whatever_is_ordered(void **state)
{
    (void)state;
    static const char *const orders[] = {"mode full", "mode safe", "mode passive", "stop"};
    base_robot_watch(&robot, OPENED_MS + BASE_COMMANDER_MS);
    assert_non_null(strstr(log_line, "wheels stopped"));
    int64_t now_ms = OPENED_MS + BASE_COMMANDER_MS;
    for (int i = 0; now_ms < HEARD_MS + BASE_SILENCE_MS; now_ms += CREATE_OI_PERIOD_MS, i++) {
        say(commander, orders[i % 4], now_ms);
        base_robot_watch(&robot, now_ms);
        assert_int_equal(robot.silences, 0);
    }
    base_robot_watch(&robot, HEARD_MS + BASE_SILENCE_MS);
    assert_int_equal(robot.silences, 1);
    assert_non_null(strstr(log_line, "the wheels may turn"));
}

/* The wheels stood from the first stop on, whichever client says it again. */
static void a_stop_said_again_changes_nothing(void **state)
{
    (void)state;
    say(commander, "stop", ORDERED_MS);
    say(commander, "stop", ORDERED_MS + 200);
    base_robot_watch(&robot, HEARD_MS + BASE_SILENCE_MS);
    say(commander, "drive 0.2 0", BACK_MS - 100); /* it is not driven blind */
    assert_driven_until(ORDERED_MS);
}

/* The cable is out: the base goes on with its last order, until the port is back. */
static void a_stop_that_was_not_written_was_not_heard(void **state)
{
    (void)state;
    close(line);
    say(commander, "drive 0 0", ORDERED_MS);
    assert_int_equal(robot.port, -1);
    assert_non_null(strstr(log_line, "Broken pipe; the wheels may turn; plug it in again"));
    assert_true(base_robot_open(&robot, pair(SOCK_STREAM, &line), BACK_MS));
    assert_driven_until(BACK_MS);
}

#define SILENCE(test) cmocka_unit_test_setup_teardown(test, begin, end)

int main(void)
{
    const struct CMUnitTest tests[] = {
        SILENCE(a_stop_ends_the_motion),
        SILENCE(a_drive_at_no_speed_ends_the_motion),
        SILENCE(another_clients_stop_ends_the_motion),
        SILENCE(a_change_of_mode_ends_the_motion),
        SILENCE(a_commander_that_goes_ends_the_motion),
        SILENCE(the_drivers_own_stops_end_the_motion),
        SILENCE(a_silence_that_is_noticed_ends_the_motion),
        SILENCE(a_silence_counts_from_the_last_frame_whatever_is_ordered),
        SILENCE(a_stop_said_again_changes_nothing),
        SILENCE(a_stop_that_was_not_written_was_not_heard),
    };
    return cmocka_run_group_tests_name("base silence", tests, NULL, NULL);
}
