/* Who may command, who has a place, what is logged of it; and what holds the wheels. */
#include "base_rig.h"

#include <math.h>

#define OPENED_MS 1000
#define MANY (BASE_CLIENTS + 1)

static int far[MANY]; /* of the clients */
static char answer[1100];

static int begin_by(bool stream_clock)
{
    begin_rig(stream_clock, base_clients_step, OPENED_MS);
    for (int i = 0; i < MANY; i++) {
        far[i] = -1;
    }
    return 0;
}

static int begin(void **state)
{
    (void)state;
    return begin_by(false);
}

static int begin_by_stream(void **state)
{
    (void)state;
    return begin_by(true);
}

static int end(void **state)
{
    (void)state;
    for (int i = 0; i < MANY; i++) {
        if (far[i] >= 0) {
            close(far[i]);
        }
    }
    end_rig();
    return 0;
}

static bool come(int i, int64_t now_ms)
{
    return base_clients_add(&clients, pair(SOCK_SEQPACKET, &far[i]), now_ms);
}

/* What client i received; empty: its connection was closed. NULL: nothing. */
static const char *reported(int i)
{
    const ssize_t got = recv(far[i], answer, sizeof answer - 1, 0);
    answer[got > 0 ? got : 0] = '\0';
    return got < 0 ? NULL : answer;
}

static const char *ask(int i, const char *message, int64_t now_ms)
{
    say(far[i], message, now_ms);
    return reported(i);
}

/* Says something that is not read yet. */
static void say_unheard(int i, const char *message)
{
    assert_int_equal(send(far[i], message, strlen(message), 0), strlen(message));
}

static bool closed(int i)
{
    const char *text = reported(i);
    return text && !*text;
}

static void assert_answer(const char *text, const char *beginning)
{
    assert_non_null(text);
    assert_memory_equal(text, beginning, strlen(beginning));
}

/* ---------------------------------------------------------------------------------------------------------- the
 * command
 */

static void a_silent_commander_loses_the_command_to_the_next_that_drives(void **state)
{
    (void)state;
    assert_true(come(0, OPENED_MS) && come(1, OPENED_MS));
    assert_answer(ask(0, "drive 0.2 0", OPENED_MS), "sent ");
    assert_answer(ask(0, "odometry", OPENED_MS + BASE_PLACE_MS - 1), "odometry "); /* observing is no order */
    assert_answer(ask(1, "drive 0.1 0", OPENED_MS + BASE_PLACE_MS - 1), "error another client commands");
    assert_answer(ask(1, "drive 0.1 0", OPENED_MS + BASE_PLACE_MS), "sent ");
    assert_answer(ask(0, "drive 0.2 0", OPENED_MS + BASE_PLACE_MS), "error another client commands");
}

static void a_commander_that_orders_keeps_the_command(void **state)
{
    static const char *const orders[] = {"drive 0 0", "stop", "mode safe"};
    (void)state;
    assert_true(come(0, OPENED_MS) && come(1, OPENED_MS));
    assert_answer(ask(0, "drive 0.2 0", OPENED_MS), "sent ");
    for (int i = 0; i < 9; i++) {
        const int64_t now_ms = OPENED_MS + (i + 1) * (BASE_PLACE_MS - 1);
        assert_answer(ask(1, "stop", now_ms), "sent "); /* that of another is none of the commander's */
        assert_answer(ask(1, "drive 0.1 0", now_ms), "error another client commands");
        assert_answer(ask(0, orders[i % 3], now_ms), "sent ");
    }
}

static void by_the_streams_clock_frames_count(void **state)
{
    (void)state;
    assert_true(come(0, OPENED_MS) && come(1, OPENED_MS));
    assert_answer(ask(0, "drive 0 0", OPENED_MS), "sent ");
    for (int i = 0; i < BASE_PLACE_FRAMES; i++) {
        assert_answer(ask(1, "drive 0.1 0", OPENED_MS + 100 * BASE_PLACE_MS), "error another client commands");
        report_frame(0, 0, OPENED_MS);
    }
    assert_answer(ask(1, "drive 0.1 0", OPENED_MS), "sent ");
}

/* ----------------------------------------------------------------------------------------------------------- the
 * places
 */

/* A client at each place, the last of them now, the others not long ago. */
#define CAME_MS(i) ((BASE_CLIENTS - 1 - (i)) * 8 / BASE_CLIENTS)
static void fill_places(int64_t now_ms)
{
    for (int i = 0; i < BASE_CLIENTS; i++) {
        assert_true(come(i, now_ms - CAME_MS(i)));
    }
}

static void who_has_said_nothing_loses_its_place_to_a_new_client(void **state)
{
    (void)state;
    fill_places(OPENED_MS);
    assert_answer(ask(0, "health", OPENED_MS), "health ");
    say_unheard(1, "health");                                       /* it has not been read yet */
    const int64_t late_ms = OPENED_MS - CAME_MS(2) + BASE_SPEAK_MS; /* client 2 has had its time */
    assert_true(base_clients_crowded(&clients, late_ms - 1));
    assert_false(base_clients_crowded(&clients, late_ms));
    assert_true(come(BASE_CLIENTS, late_ms));
    assert_true(closed(2));
    assert_null(reported(0));
    assert_null(reported(1));
}

static void who_has_said_nonsense_loses_its_place_at_once(void **state)
{
    (void)state;
    fill_places(OPENED_MS);
    assert_answer(ask(7, "rubbish", OPENED_MS), "error ");
    assert_answer(ask(9, "health", OPENED_MS), "health ");
    assert_answer(ask(9, "rubbish", OPENED_MS), "error "); /* it has said something good too */
    assert_false(base_clients_crowded(&clients, OPENED_MS));
    assert_true(come(BASE_CLIENTS, OPENED_MS));
    assert_true(closed(7));
    assert_true(base_clients_crowded(&clients, OPENED_MS));
}

static void who_has_spoken_of_late_keeps_its_place(void **state)
{
    (void)state;
    fill_places(OPENED_MS);
    for (int i = 0; i < BASE_CLIENTS; i++) {
        assert_answer(ask(i, "odometry", OPENED_MS + (i == 3 ? 0 : 1)), "odometry ");
    }
    assert_false(base_clients_crowded(&clients, OPENED_MS + BASE_PLACE_MS - 1));
    assert_false(come(BASE_CLIENTS, OPENED_MS + BASE_PLACE_MS - 1));
    assert_answer(reported(BASE_CLIENTS), "error 64 clients are connected; end one of them first");
    close(far[BASE_CLIENTS]);
    assert_true(come(BASE_CLIENTS, OPENED_MS + BASE_PLACE_MS));
    assert_true(closed(3));
}

static void who_has_said_nothing_goes_before_who_has_been_silent_for_longer(void **state)
{
    (void)state;
    fill_places(OPENED_MS);
    for (int i = 0; i < BASE_CLIENTS - 1; i++) {
        assert_answer(ask(i, "health", OPENED_MS - 100), "health ");
    }
    assert_true(come(BASE_CLIENTS, OPENED_MS + BASE_PLACE_MS));
    assert_true(closed(BASE_CLIENTS - 1));
}

static void the_commander_keeps_its_place_while_it_orders(void **state)
{
    (void)state;
    fill_places(OPENED_MS);
    assert_answer(ask(0, "drive 0 0", OPENED_MS), "sent ");
    for (int i = 1; i < BASE_CLIENTS; i++) {
        assert_answer(ask(i, "health", OPENED_MS + 1), "health ");
    }
    assert_answer(ask(0, "stop", OPENED_MS + 2), "sent ");
    clients.client[0].heard_ms = OPENED_MS; /* silent longest, by what it has asked */
    assert_true(come(BASE_CLIENTS, OPENED_MS + BASE_PLACE_MS + 1));
    assert_true(closed(1));
    assert_null(reported(0));
}

static void in_lock_step_the_leader_of_the_stream_keeps_its_place(void **state)
{
    (void)state;
    fill_places(OPENED_MS);
    say(far[0], "odometry after 1000", OPENED_MS);
    assert_true(come(BASE_CLIENTS, OPENED_MS + 1000 * BASE_PLACE_MS));
    assert_null(reported(0));
    assert_true(closed(1));
}

static void by_the_wall_clock_waiting_for_a_byte_keeps_no_place(void **state)
{
    (void)state;
    fill_places(OPENED_MS);
    say(far[0], "odometry after 18446744073709551615", OPENED_MS);
    assert_true(come(BASE_CLIENTS, OPENED_MS + BASE_SPEAK_MS));
    assert_true(closed(0));
}

/* ------------------------------------------------------------------------------------------------------ holds, and
 * logs
 */

static void while_one_reason_holds_the_wheels_stand(void **state)
{
    (void)state;
    assert_true(come(0, OPENED_MS));
    assert_answer(ask(0, "drive 0.2 0", OPENED_MS + BASE_PACE_MS), "sent 60 0.2 0");
    base_robot_hold(&robot, BASE_HOLD_HEARTBEAT, true, OPENED_MS + BASE_PACE_MS);
    assert_int_equal(robot.speeds.left_mm_s, 0);
    base_robot_hold(&robot, BASE_HOLD_SLEEP, true, OPENED_MS + BASE_PACE_MS);
    base_robot_hold(&robot, BASE_HOLD_HEARTBEAT, false, OPENED_MS + BASE_PACE_MS);
    assert_answer(ask(0, "drive 0.2 0", OPENED_MS + 2 * BASE_PACE_MS), "sent 70 0 0");
    assert_non_null(strstr(ask(0, "health", OPENED_MS + 2 * BASE_PACE_MS), " held=sleep "));
    base_robot_hold(&robot, BASE_HOLD_SLEEP, false, OPENED_MS + 2 * BASE_PACE_MS);
    assert_answer(ask(0, "drive 0.2 0", OPENED_MS + 3 * BASE_PACE_MS), "sent 75 0.2 0");
}

static void a_line_that_stays_silent_is_logged_once_and_then_every_hour(void **state)
{
    (void)state;
    report_frame(0, 0, OPENED_MS);
    log_lines = 0; /* that of its empty battery */
    int64_t now_ms = OPENED_MS + BASE_SILENCE_MS;
    for (; now_ms < OPENED_MS + BASE_TELL_MS + BASE_SILENCE_MS; now_ms += BASE_SILENCE_MS) {
        base_robot_watch(&robot, now_ms);
        char bytes[256];
        while (recv(line, bytes, sizeof bytes, 0) > 0) {
        }
    }
    assert_int_equal(robot.silences, BASE_TELL_MS / BASE_SILENCE_MS);
    assert_int_equal(log_lines, 1);
    base_robot_watch(&robot, now_ms);
    assert_int_equal(log_lines, 2);
    report_frame(0, 0, now_ms + 1);
    assert_int_equal(log_lines, 3);
    report_frame(0, 0, now_ms + 2);
    assert_int_equal(log_lines, 3);
    base_robot_watch(&robot, now_ms + 2 + BASE_SILENCE_MS); /* another silence */
    assert_int_equal(log_lines, 4);
}

static void of_a_line_that_comes_too_often_five_a_minute_are_logged(void **state)
{
    (void)state;
    struct base_log_limit limit = {0};
    unsigned hidden;
    for (int i = 0; i < BASE_LOG_LINES; i++) {
        assert_true(base_log_pass(&limit, i, &hidden));
        assert_int_equal(hidden, 0);
    }
    for (int i = 0; i < 7; i++) {
        assert_false(base_log_pass(&limit, BASE_LOG_MS - 1, &hidden));
    }
    assert_true(base_log_pass(&limit, BASE_LOG_MS, &hidden));
    assert_int_equal(hidden, 7);
    assert_true(base_log_pass(&limit, BASE_LOG_MS, &hidden));
    assert_int_equal(hidden, 0);
}

static void clients_that_come_and_go_fill_no_log(void **state)
{
    (void)state;
    for (int i = 0; i < 1000; i++) {
        assert_true(come(0, OPENED_MS));
        assert_answer(ask(0, "drive 0.2 0", OPENED_MS), "sent ");
        close(far[0]);
        serve(OPENED_MS);
        char bytes[256];
        while (recv(line, bytes, sizeof bytes, 0) > 0) {
        }
    }
    far[0] = -1;
    assert_in_range(log_lines, 1, BASE_LOG_LINES);
}

/* A frame is lost beside an order for other speeds: what was ordered over it is two frames' time, on any machine. */
static void in_lock_step_what_was_ordered_counts_frames_not_the_machines_time(void **state)
{
    (void)state;
    const uint8_t lost[CREATE_STREAM_BYTES] = {0};
    int64_t now_ms = OPENED_MS;
    for (int64_t pause_ms = 0; pause_ms <= 200; pause_ms += 100) {
        base_robot_drive(&robot, 0.1, 0.0, now_ms);
        report_frame(100, 1, now_ms += pause_ms);
        base_robot_drive(&robot, 0.2, 0.0, now_ms += pause_ms);
        assert_int_equal(send(line, lost, robot.stream.length, 0), robot.stream.length);
        report_frame(200, 3, now_ms += pause_ms);
        assert_int_equal(robot.frame.missed, 1);
        assert_true(robot.frame.ordered.changed);
        assert_int_equal(lround(robot.frame.ordered.distance * 1e6), lround(0.2 * 2 * 1e3 * CREATE_OI_PERIOD_MS));
    }
}

#define WALL(test) cmocka_unit_test_setup_teardown(test, begin, end)
#define STREAM(test) cmocka_unit_test_setup_teardown(test, begin_by_stream, end)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WALL(a_silent_commander_loses_the_command_to_the_next_that_drives),
        WALL(a_commander_that_orders_keeps_the_command),
        STREAM(by_the_streams_clock_frames_count),
        STREAM(in_lock_step_what_was_ordered_counts_frames_not_the_machines_time),
        WALL(who_has_said_nothing_loses_its_place_to_a_new_client),
        WALL(who_has_said_nonsense_loses_its_place_at_once),
        WALL(who_has_spoken_of_late_keeps_its_place),
        WALL(who_has_said_nothing_goes_before_who_has_been_silent_for_longer),
        WALL(the_commander_keeps_its_place_while_it_orders),
        STREAM(in_lock_step_the_leader_of_the_stream_keeps_its_place),
        WALL(by_the_wall_clock_waiting_for_a_byte_keeps_no_place),
        WALL(while_one_reason_holds_the_wheels_stand),
        WALL(a_line_that_stays_silent_is_logged_once_and_then_every_hour),
        WALL(of_a_line_that_comes_too_often_five_a_minute_are_logged),
        WALL(clients_that_come_and_go_fill_no_log),
    };
    return cmocka_run_group_tests_name("base clients", tests, NULL, NULL);
}
