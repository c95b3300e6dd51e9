/* What of a base is believed, and when: nothing that it did not say in the last half second, after it was asked. */
#include "base_met.h"

#include <math.h>

#define OPENED_MS 1000
#define FRAME_MS CREATE_OI_PERIOD_MS

static struct create_motion motion;
static bool carried;         /* as the newest frame was passed on */
static uint8_t orders[4096]; /* written since the last look */
static size_t order_count;

static void on_step(void *context, const struct create_step *step, unsigned bits)
{
    base_clients_step(context, step, bits);
    carried = bits & BASE_CARRIED;
    create_motion_add(&motion, step);
}

/* Opened, and not heard yet. */
static int begin_unheard(void **state)
{
    (void)state;
    open_rig(false, on_step, OPENED_MS);
    motion = (struct create_motion){0};
    meet(OPENED_MS);
    return 0;
}

/* In safe mode. */
static int begin(void **state)
{
    (void)state;
    begin_rig(false, on_step, OPENED_MS);
    motion = (struct create_motion){0};
    meet(OPENED_MS);
    return 0;
}

/* Whether this opcode was written since the last look. Speeds of these tests are no opcodes. */
static bool was_asked_for(enum create_oi_opcode opcode)
{
    const ssize_t got = recv(line, orders, sizeof orders, 0);
    order_count = got > 0 ? (size_t)got : 0;
    return memchr(orders, opcode, order_count) != NULL;
}

static const char *health(int64_t now_ms)
{
    static char text[1100];
    char old[1100];
    while (recv(other, old, sizeof old, 0) > 0) {
    }
    say(other, "health", now_ms);
    const ssize_t got = recv(other, text, sizeof text - 1, 0);
    assert_true(got > 0);
    text[got] = '\0';
    return text;
}

static void assert_kept(int64_t now_ms)
{
    say(commander, "drive 0.2 0", now_ms);
    assert_int_equal(robot.speeds.left_mm_s, 0);
    assert_int_equal(robot.written.left_mm_s, 0);
    assert_true(base_robot_bits(&robot) & BASE_IDLE);
}

static void a_base_that_was_never_heard_on_this_connection_stands(void **state)
{
    (void)state;
    for (int64_t now_ms = OPENED_MS; now_ms < OPENED_MS + 3000; now_ms += 50) {
        base_robot_watch(&robot, now_ms);
        assert_kept(now_ms);
    }
    assert_non_null(strstr(health(OPENED_MS + 3000), " mode=unknown "));
    assert_non_null(strstr(health(OPENED_MS + 3000), " orders=unknown voltage_mv=unknown "));
}

static void what_it_said_on_another_connection_does_not_count(void **state)
{
    (void)state;
    close(line);
    assert_false(base_robot_read(&robot, UINT64_MAX, OPENED_MS));
    assert_true(base_robot_open(&robot, pair(SOCK_STREAM, &line), OPENED_MS + 50));
    assert_kept(OPENED_MS + 60);
    assert_int_equal(base_robot_bits(&robot), BASE_IDLE);
    assert_non_null(strstr(health(OPENED_MS + 60), " mode=unknown "));
}

/* Nobody knows whether it was moved meanwhile, unless it has encoders. */
static void a_base_that_was_not_heard_for_a_while_may_have_been_carried(void **state)
{
    (void)state;
    const int64_t heard_ms = OPENED_MS + FRAME_MS, silent_ms = heard_ms + BASE_SILENCE_MS;
    for (int encoders = 0; encoders < 2; encoders++) {
        robot.odometry.started = encoders;
        report_frame(0, 0, heard_ms + encoders * (BASE_SILENCE_MS + 2 * FRAME_MS));
        assert_false(carried);
        base_robot_watch(&robot, silent_ms + encoders * (BASE_SILENCE_MS + 3 * FRAME_MS));
        report(CREATE_OI_MODE_PASSIVE, 0, 0, robot.opened_ms + FRAME_MS);
        assert_int_equal(carried, !encoders);
        assert_true(robot.frame.unheard);
        report_frame(0, 0, robot.opened_ms + 2 * FRAME_MS);
        assert_false(carried || robot.frame.unheard);
    }
}

/* It goes on to send what an earlier request asked for: it does not hear this one. */
static void frames_of_an_earlier_request_are_no_answer(void **state)
{
    (void)state;
    const struct create_stream before = robot.stream;
    say(commander, "mode full", OPENED_MS + 200);
    const struct create_stream asked = robot.stream;
    assert_memory_not_equal(before.expected, asked.expected, asked.length);
    for (int i = 0; i < 100; i++) { /* to the letter, in the order of before */
        robot.stream = before;
        report_frame(0, 0, OPENED_MS + 200 + i);
        robot.stream = asked;
        robot.answered = false;
    }
    assert_kept(OPENED_MS + 300);
    assert_int_equal(robot.phase, BASE_RESTING);
}

/* So it is reported, however often the request is repeated. */
static void a_base_that_goes_on_with_an_earlier_request_is_reported(void **state)
{
    (void)state;
    const uint8_t frame[] = {CREATE_OI_STREAM_HEADER, (uint8_t)(robot.stream.length - CREATE_OI_STREAM_OVERHEAD)};
    for (int64_t now_ms = OPENED_MS; now_ms < OPENED_MS + 3 * BASE_SILENCE_MS; now_ms += FRAME_MS) {
        assert_int_equal(send(line, frame, sizeof frame, 0), sizeof frame);
        base_robot_read(&robot, UINT64_MAX, now_ms);
        base_robot_watch(&robot, now_ms);
        assert_kept(now_ms);
    }
    assert_int_equal(log_lines, 1);
}

/* Of a base that charges a line comes each second: it is reported when it has come, and once. */
static void what_tells_more_than_nothing_is_told_once(void **state)
{
    (void)state;
    static const char text[] = "battery 14200 mV\r\n";
    for (int i = 1; i <= 4; i++) {
        if (i % 2 == 0) {
            assert_int_equal(send(line, text, sizeof text, 0), sizeof text);
        }
        const int64_t now_ms = robot.opened_ms + BASE_SILENCE_MS;
        base_robot_read(&robot, UINT64_MAX, now_ms);
        base_robot_watch(&robot, now_ms);
        assert_int_equal(log_lines, i < 2 ? 1 : 2);
    }
}

static void a_base_that_is_not_heard_for_half_a_second_stands(void **state)
{
    (void)state;
    say(commander, "drive 0.2 0", OPENED_MS + FRAME_MS);
    assert_int_equal(robot.written.left_mm_s, 200);
    say(commander, "drive 0.2 0", OPENED_MS + BASE_SILENCE_MS - 50);
    base_robot_watch(&robot, OPENED_MS + BASE_SILENCE_MS - 1);
    assert_int_equal(robot.written.left_mm_s, 200);
    base_robot_watch(&robot, OPENED_MS + BASE_SILENCE_MS);
    assert_int_equal(robot.written.left_mm_s, 0);
    assert_kept(OPENED_MS + BASE_SILENCE_MS);
    assert_non_null(strstr(health(OPENED_MS + BASE_SILENCE_MS), " mode=unknown "));
}

/* The driver did not run for 3 s: what waits to be read is of the beginning of that time. */
static void what_has_waited_to_be_read_is_old(void **state)
{
    (void)state;
    for (int i = 0; i < 20; i++) {
        uint8_t frame[CREATE_STREAM_BYTES];
        const size_t count = make_frame(CREATE_OI_MODE_SAFE, 0, 0, frame);
        assert_int_equal(send(line, frame, count, 0), count);
    }
    base_robot_read(&robot, UINT64_MAX, OPENED_MS + 3000);
    assert_int_equal(robot.frame_ms, OPENED_MS + 20 * FRAME_MS);
    assert_kept(OPENED_MS + 3000);
    report_frame(0, 0, OPENED_MS + 3001);
    assert_false(base_robot_kept(&robot));
}

/* ------------------------------------------------------------------------------------------------------------ the mode
 */

/* A pilot says its mode in each block of 20 ms, until it sees it. */
static void a_mode_that_is_said_again_and_again_is_entered(void **state)
{
    (void)state;
    int64_t now_ms = OPENED_MS;
    const unsigned requests = robot.requests;
    for (int i = 0; i < 30; i++) {
        say(commander, "mode full", now_ms += FRAME_MS);
        base_robot_watch(&robot, now_ms);
        report(i < 20 ? CREATE_OI_MODE_PASSIVE : CREATE_OI_MODE_FULL, 0, 0, now_ms);
    }
    assert_int_equal(robot.requests, requests + 1);
    assert_int_equal(robot.phase, BASE_ENTERED);
}

static void a_mode_is_asked_for_until_the_base_says_it(void **state)
{
    (void)state;
    int64_t now_ms = OPENED_MS;
    report(CREATE_OI_MODE_PASSIVE, 0, 0, now_ms += FRAME_MS);
    assert_true(was_asked_for(CREATE_OI_OP_SAFE));
    int asked = 0;
    for (int i = 0; i < 60; i++) {
        report(CREATE_OI_MODE_PASSIVE, 0, 0, now_ms += FRAME_MS);
        asked += was_asked_for(CREATE_OI_OP_SAFE);
        assert_kept(now_ms);
    }
    assert_in_range(asked, 10, 13);
    assert_int_equal(log_lines, 0);
    for (int i = 0; i < 10; i++) {
        report(CREATE_OI_MODE_PASSIVE, 0, 0, now_ms += FRAME_MS);
    }
    assert_int_equal(log_lines, 1); /* after a second a person is informed */
    report_frame(0, 0, now_ms += FRAME_MS);
    assert_false(base_robot_kept(&robot));
}

/* When the base says that it is in full mode. */
static int64_t enter_full(void)
{
    int64_t now_ms = OPENED_MS + 200;
    say(commander, "mode full", now_ms);
    report(CREATE_OI_MODE_PASSIVE, 0, 0, now_ms += FRAME_MS);
    report(CREATE_OI_MODE_FULL, 0, 0, now_ms += FRAME_MS);
    return now_ms;
}

/* The order `safe` after `full` is lost: the base is in full mode, and says so. */
static void a_base_that_did_not_hear_of_a_lower_mode_does_not_drive(void **state)
{
    (void)state;
    int64_t now_ms = enter_full();
    assert_non_null(strstr(health(now_ms), " mode=full "));
    say(commander, "mode safe", now_ms += 200);
    for (int i = 0; i < 200; i++) { /* it hears the request, and not what stands before it */
        report(CREATE_OI_MODE_FULL, 0, 0, now_ms += FRAME_MS);
        assert_kept(now_ms);
        assert_null(strstr(health(now_ms), " mode=safe "));
    }
    assert_int_equal(robot.mode_offset, 0);
}

static void a_mode_ends_with_who_asked_for_it(void **state)
{
    (void)state;
    int64_t now_ms = enter_full();
    say(other, "drive 0 0", now_ms + BASE_PLACE_MS); /* it has ordered nothing for so long: another takes the command */
    assert_int_equal(robot.wanted, CREATE_OI_MODE_SAFE);
    assert_true(base_robot_kept(&robot));
}

/* One frame that lied said passive as other firmwares count: what follows does not fit, and is not believed. */
static void a_mode_above_the_one_asked_for_is_not_believed(void **state)
{
    (void)state;
    int64_t now_ms = OPENED_MS;
    report(CREATE_OI_MODE_PASSIVE, 0, 0, now_ms += FRAME_MS);
    assert_int_equal(robot.phase, BASE_ENTERING);
    report(CREATE_OI_MODE_FULL, 0, 0, now_ms += 100);
    assert_int_equal(robot.phase, BASE_RESTING);
    assert_non_null(strstr(health(now_ms), " mode=unknown "));
}

static void a_mode_above_the_one_in_force_is_a_lie(void **state)
{
    (void)state;
    say(commander, "drive 0.2 0", OPENED_MS + FRAME_MS);
    report(CREATE_OI_MODE_FULL, 200, 3, OPENED_MS + 2 * FRAME_MS);
    assert_int_equal(robot.phase, BASE_RESTING);
    assert_kept(OPENED_MS + 200);
    assert_int_equal(robot.mode_losses, 0);
}

/* It sends what was asked for before: what it has half of may be the longest command. */
static void a_base_that_does_not_hear_the_request_is_asked_again_behind_zeros(void **state)
{
    (void)state;
    uint8_t frame[CREATE_STREAM_BYTES];
    const size_t count = make_frame(CREATE_OI_MODE_SAFE, 0, 0, frame);
    say(commander, "mode full", OPENED_MS + 200);
    carry_away();
    robot.before = (struct create_stream){0}; /* of a driver before this one */
    for (int i = 0; i < 8; i++) {
        assert_int_equal(send(line, frame, count, 0), count);
        base_robot_read(&robot, UINT64_MAX, OPENED_MS + 200 + i * FRAME_MS);
        base_robot_watch(&robot, OPENED_MS + 200 + i * FRAME_MS);
    }
    assert_true(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
    assert_true(order_count > CREATE_COMMAND_MOST);
    base_robot_watch(&robot, OPENED_MS + 200 + 7 * FRAME_MS + 100);
    assert_true(was_asked_for(CREATE_OI_OP_STREAM));
}

/* Lets go, and is gone: it rests until somebody takes the command. */
static void a_base_that_was_let_go_rests_until_somebody_commands(void **state)
{
    (void)state;
    int64_t now_ms = OPENED_MS + 200;
    say(commander, "mode passive", now_ms);
    report(CREATE_OI_MODE_PASSIVE, 0, 0, now_ms += FRAME_MS);
    close(commander);
    serve(now_ms += FRAME_MS);
    commander = dup(other);
    assert_int_equal(robot.wanted, CREATE_OI_MODE_PASSIVE);
    say(other, "drive 0 0", now_ms + BASE_PLACE_MS);
    assert_int_equal(robot.wanted, CREATE_OI_MODE_SAFE);
}

/* ----------------------------------------------------------------------------------------------------------- the
 * orders
 */

static void an_order_that_the_base_does_not_repeat_is_written_again(void **state)
{
    (void)state;
    int64_t now_ms = OPENED_MS;
    say(commander, "drive 0.2 0", now_ms += FRAME_MS);
    assert_true(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
    for (int i = 0; i < 5; i++) {
        report_frame(0, 0, now_ms += FRAME_MS);
        base_robot_watch(&robot, now_ms);
        assert_false(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
    }
    assert_non_null(strstr(health(now_ms), " orders=unheard "));
    report_frame(0, 0, now_ms += FRAME_MS);
    base_robot_watch(&robot, now_ms);
    assert_true(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
    assert_int_equal(orders[0], 0); /* behind zero bytes: half of it may be there */
    base_robot_watch(&robot, now_ms += FRAME_MS);
    report_frame(200, 3, now_ms);
    assert_non_null(strstr(health(now_ms), " orders=heard "));
}

/* An opcode that was altered on the way may have the base take all that follows for a song. */
static void a_stop_that_is_not_heard_is_written_behind_the_longest_command(void **state)
{
    (void)state;
    static const uint8_t zeros[CREATE_COMMAND_MOST], stop[] = {CREATE_OI_OP_DRIVE_DIRECT, 0, 0, 0, 0};
    int64_t now_ms = OPENED_MS;
    say(commander, "drive 0.2 0", now_ms += FRAME_MS);
    report_frame(200, 3, now_ms += FRAME_MS);
    say(commander, "stop", now_ms);
    for (int i = 0; i < 6; i++) {
        report_frame(200, 3, now_ms += FRAME_MS);
    }
    assert_true(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
    assert_true(order_count >= sizeof zeros + sizeof stop);
    const uint8_t *last = orders + order_count - sizeof stop;
    assert_memory_equal(last, stop, sizeof stop);
    assert_memory_equal(last - sizeof zeros, zeros, sizeof zeros);
    const uint8_t *first = memchr(orders, CREATE_OI_OP_DRIVE_DIRECT, order_count);
    assert_true(first < last - sizeof zeros); /* and at once, for a base that lacks less */
}

/* Whatever is ordered meanwhile. */
static void a_base_that_says_the_same_whatever_is_ordered_is_not_heard(void **state)
{
    (void)state;
    int64_t now_ms = OPENED_MS;
    for (int i = 0; i < 7; i++) {
        base_robot_drive(&robot, 0.2 + 0.01 * i, 0, now_ms += FRAME_MS);
        was_asked_for(CREATE_OI_OP_DRIVE_DIRECT);
        report(CREATE_OI_MODE_SAFE, 200, 3, now_ms);
    }
    assert_true(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
    assert_true(order_count > CREATE_COMMAND_MOST);
}

static void assert_may_turn(int64_t now_ms)
{
    base_robot_stop(&robot, now_ms);
    assert_string_equal(base_robot_fate(&robot), "ordered to stop, but not heard to: the wheels may turn");
}

static void wheels_of_a_base_that_is_not_heard_may_turn(void **state)
{
    (void)state;
    int64_t now_ms = OPENED_MS;
    base_robot_stop(&robot, now_ms);
    assert_string_equal(base_robot_fate(&robot), "wheels stopped");
    for (int i = 0; i < 7; i++) { /* it goes on as before */
        report(CREATE_OI_MODE_SAFE, 200, 3, now_ms += FRAME_MS);
    }
    assert_may_turn(now_ms);
    report(CREATE_OI_MODE_SAFE, 0, 0, now_ms += FRAME_MS);
    assert_string_equal(base_robot_fate(&robot), "wheels stopped");
    base_robot_watch(&robot, now_ms += BASE_SILENCE_MS);
    assert_may_turn(now_ms);
    close(line); /* the cable is out */
    base_robot_stop(&robot, now_ms + BASE_PACE_MS);
    assert_int_equal(robot.port, -1);
    assert_may_turn(now_ms);
}

/* Lost bytes may have left half an order, for the next one to complete. */
static void an_order_after_a_pause_begins_with_zero_bytes(void **state)
{
    (void)state;
    for (int late = 0; late < 2; late++) {
        const int64_t now_ms = robot.written_ms + BASE_SILENCE_MS - 1 + late;
        was_asked_for(CREATE_OI_OP_DRIVE_DIRECT);
        base_robot_stop(&robot, now_ms);
        assert_true(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
        assert_int_equal(orders[0], late ? 0 : CREATE_OI_OP_DRIVE_DIRECT);
    }
}

/* A hundred orders in a millisecond: the line carries one a frame, and a stop at once. */
static void orders_without_a_pause_leave_the_line_free_for_a_stop(void **state)
{
    (void)state;
    size_t written = 0;
    for (int ms = 0; ms < 1000; ms++) {
        for (int i = 0; i < 100; i++) {
            base_robot_drive(&robot, 0.2 + 0.001 * i, 0, OPENED_MS + ms);
        }
        written += was_asked_for(CREATE_OI_OP_DRIVE_DIRECT) ? order_count : 0;
        if (ms % FRAME_MS == 0) {
            report_frame(robot.written.left_mm_s, 3, OPENED_MS + ms);
        }
        base_robot_watch(&robot, OPENED_MS + ms);
        written += was_asked_for(CREATE_OI_OP_DRIVE_DIRECT) ? order_count : 0;
    }
    assert_in_range(written, 1000 / FRAME_MS * 5 - 5, 1000 / FRAME_MS * 5 + 5);
    base_robot_watch(&robot, OPENED_MS + 1000 + FRAME_MS);
    assert_true(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
    assert_int_equal(robot.written.left_mm_s, 299); /* of those that came meanwhile the newest */
    assert_true(base_robot_stop(&robot, OPENED_MS + 1000 + FRAME_MS));
    assert_true(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
    assert_int_equal(order_count, 5);
    for (int i = 0; i < 100; i++) { /* nor do stops fill it */
        base_robot_stop(&robot, OPENED_MS + 1000 + FRAME_MS);
    }
    assert_false(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
}

/* An adapter that takes nothing more is no adapter that is gone: the stop is written when there is room. */
static void a_stop_is_tried_until_it_is_written(void **state)
{
    (void)state;
    static const uint8_t zeros[4096];
    char answer[200] = "";
    say(commander, "drive 0.2 0", OPENED_MS + FRAME_MS);
    carry_away();
    while (send(robot.port, zeros, sizeof zeros, 0) > 0) {
    }
    while (send(robot.port, zeros, 1, 0) > 0) {
    }
    assert_true(recv(commander, answer, sizeof answer, 0) > 0);
    assert_int_equal(send(commander, "stop", 4, 0), 4);
    serve(OPENED_MS + 2 * FRAME_MS);
    assert_true(recv(commander, answer, sizeof answer, 0) > 0);
    assert_non_null(strstr(answer, "error no stop could be written: the wheels may turn"));
    assert_int_equal(base_robot_watch(&robot, OPENED_MS + 2 * FRAME_MS), BASE_RETRY_MS);
    assert_true(robot.port >= 0);
    assert_false(base_robot_end(&robot, OPENED_MS + 2 * FRAME_MS));
    carry_away();
    base_robot_watch(&robot, OPENED_MS + 2 * FRAME_MS + BASE_RETRY_MS);
    assert_string_equal(base_robot_fate(&robot), "wheels stopped");
    assert_true(was_asked_for(CREATE_OI_OP_DRIVE_DIRECT));
    assert_true(base_robot_end(&robot, OPENED_MS + 2 * FRAME_MS + BASE_RETRY_MS));
}

/* ------------------------------------------------------------------------------------------------------------ the
 * clock
 */

/* Driving, by 20 frames in time; when the last came. */
static int64_t drive_evenly(void)
{
    int64_t now_ms = OPENED_MS;
    say(commander, "drive 0.2 0", now_ms + FRAME_MS);
    for (int i = 0; i < 20; i++) {
        report_frame(200, 3, now_ms += FRAME_MS);
    }
    motion = (struct create_motion){0};
    base_robot_read(&robot, UINT64_MAX, now_ms + 299);
    return now_ms;
}

/* Frames each 15 ms, and a hole in them, whatever the bytes show. */
static void the_clock_says_how_long_a_gap_is(void **state)
{
    (void)state;
    int64_t now_ms = drive_evenly();
    const uint64_t missed = robot.missed;
    report_frame(200, 3, now_ms += 300);
    assert_int_equal(robot.missed - missed, 19);
    assert_true(fabs(motion.x - 0.06) < 1e-6);
    for (int i = 0; i < 100; i++) { /* an adapter gives two at a time, and now and then one late */
        base_robot_read(&robot, UINT64_MAX, now_ms + 2 * FRAME_MS - 1);
        report_frame(200, 3, now_ms += 2 * FRAME_MS);
        report_frame(200, 3, now_ms);
    }
    assert_int_equal(robot.missed - missed, 19);
}

static void frames_that_come_late_are_not_counted_twice(void **state)
{
    (void)state;
    int64_t now_ms = drive_evenly() + 300;
    for (int i = 0; i < 20; i++) {
        report_frame(200, 2, now_ms);
    }
    assert_true(fabs(motion.x - 0.04) < 1e-6);
    report_frame(200, 2, now_ms += FRAME_MS);
    assert_true(fabs(motion.x - 0.042) < 1e-6);
}

/* An adapter holds what was said for 400 ms: seven frames came of it, in two pieces, so the base has said nothing
 * since.
 */
static void what_the_line_has_held_is_old(void **state)
{
    (void)state;
    base_robot_read(&robot, UINT64_MAX, OPENED_MS + 399);
    for (int i = 0; i < 7; i++) {
        uint8_t frame[CREATE_STREAM_BYTES];
        const size_t count = make_frame(CREATE_OI_MODE_SAFE, 0, 0, frame);
        assert_int_equal(send(line, frame, count, 0), count);
        if (i >= 5) {
            assert_true(base_robot_read(&robot, UINT64_MAX, OPENED_MS + 395 + i));
        }
    }
    base_robot_watch(&robot, OPENED_MS + 7 * FRAME_MS + BASE_SILENCE_MS - 1);
    assert_true(base_robot_heard(&robot));
    base_robot_watch(&robot, OPENED_MS + 7 * FRAME_MS + BASE_SILENCE_MS);
    assert_false(base_robot_heard(&robot));
}

#define UNHEARD(test) cmocka_unit_test_setup_teardown(test, begin_unheard, end)
#define HEARD(test) cmocka_unit_test_setup_teardown(test, begin, end)

int main(void)
{
    const struct CMUnitTest tests[] = {
        UNHEARD(a_base_that_was_never_heard_on_this_connection_stands),
        HEARD(what_it_said_on_another_connection_does_not_count),
        HEARD(a_base_that_was_not_heard_for_a_while_may_have_been_carried),
        HEARD(frames_of_an_earlier_request_are_no_answer),
        UNHEARD(what_tells_more_than_nothing_is_told_once),
        UNHEARD(a_base_that_goes_on_with_an_earlier_request_is_reported),
        HEARD(a_base_that_is_not_heard_for_half_a_second_stands),
        HEARD(what_has_waited_to_be_read_is_old),
        HEARD(a_mode_that_is_said_again_and_again_is_entered),
        UNHEARD(a_mode_is_asked_for_until_the_base_says_it),
        HEARD(a_base_that_did_not_hear_of_a_lower_mode_does_not_drive),
        HEARD(a_mode_ends_with_who_asked_for_it),
        UNHEARD(a_mode_above_the_one_asked_for_is_not_believed),
        HEARD(a_mode_above_the_one_in_force_is_a_lie),
        HEARD(a_base_that_does_not_hear_the_request_is_asked_again_behind_zeros),
        HEARD(a_base_that_was_let_go_rests_until_somebody_commands),
        HEARD(an_order_that_the_base_does_not_repeat_is_written_again),
        HEARD(an_order_after_a_pause_begins_with_zero_bytes),
        HEARD(a_stop_that_is_not_heard_is_written_behind_the_longest_command),
        HEARD(a_base_that_says_the_same_whatever_is_ordered_is_not_heard),
        HEARD(wheels_of_a_base_that_is_not_heard_may_turn),
        HEARD(orders_without_a_pause_leave_the_line_free_for_a_stop),
        HEARD(a_stop_is_tried_until_it_is_written),
        HEARD(the_clock_says_how_long_a_gap_is),
        HEARD(what_the_line_has_held_is_old),
        HEARD(frames_that_come_late_are_not_counted_twice),
    };
    return cmocka_run_group_tests_name("base belief", tests, NULL, NULL);
}
