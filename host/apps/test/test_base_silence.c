/* Orders of clients while the base is silent: how far it has driven meanwhile, when it is heard again. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <signal.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "daemon_log.h"
#include "whisker_base_clients.h"

#define SPEED_MM_S 200
#define FRAME_MM (SPEED_MM_S * CREATE_OI_PERIOD_MS / 1000)
#define FRAME_M (FRAME_MM * 1e-3)
/* Of the test's clock: the port is opened, the last frame before the silence, an order within it, the next frame. */
#define OPENED_MS 1000
#define HEARD_MS (OPENED_MS + 5 * CREATE_OI_PERIOD_MS)
#define ORDERED_MS (HEARD_MS + 200)
#define BACK_MS (HEARD_MS + 1500)

static struct base_options options;
static struct base_robot robot;
static struct base_clients clients;
static int line, commander, other; /* the far ends */
static double driven_m;

void daemon_log(enum daemon_priority priority, const char *format, ...)
{
    (void)priority;
    (void)format;
}

static void on_step(void *context, const struct create_step *step, unsigned bits)
{
    base_clients_step(context, step, bits);
    driven_m += step->distance;
}

static int pair(int type, int *theirs)
{
    int ends[2];
    assert_int_equal(socketpair(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
    *theirs = ends[1];
    return ends[0];
}

static void serve(int64_t now_ms)
{
    struct pollfd polled[BASE_CLIENTS];
    base_clients_poll(&clients, polled);
    assert_true(poll(polled, BASE_CLIENTS, 0) >= 0);
    base_clients_serve(&clients, polled, now_ms);
}

static void say(int client, const char *message, int64_t now_ms)
{
    assert_int_equal(send(client, message, strlen(message), 0), strlen(message));
    serve(now_ms);
}

/* One frame of a base in safe mode that was asked for this speed, and in it moved so far. */
static void tell_frame(int asked_mm_s, int moved_mm, int64_t now_ms)
{
    uint8_t frame[CREATE_STREAM_BYTES], sum = 0;
    int32_t value[CREATE_OI_PACKET_MAX + 1] = {[CREATE_OI_MODE] = CREATE_OI_MODE_SAFE,
                                               [CREATE_OI_DISTANCE] = moved_mm,
                                               [CREATE_OI_REQUESTED_LEFT] = asked_mm_s,
                                               [CREATE_OI_REQUESTED_RIGHT] = asked_mm_s};
    const struct create_stream *stream = &robot.stream;
    memcpy(frame, stream->expected, stream->length);
    for (size_t at = 2; at + 1 < stream->length;) { /* behind header and length: id, data, id, data */
        const unsigned id = frame[at++];
        for (size_t left = create_packet_bytes(id); left > 0; left--) {
            frame[at++] = (uint8_t)((uint32_t)value[id] >> 8 * (left - 1));
        }
    }
    for (size_t i = 0; i + 1 < stream->length; i++) {
        sum = (uint8_t)(sum + frame[i]);
    }
    frame[stream->length - 1] = (uint8_t)-sum;
    assert_int_equal(send(line, frame, stream->length, 0), stream->length);
    assert_true(base_robot_read(&robot, UINT64_MAX, now_ms));
}

/* Driving, and then not heard any more. */
static int begin(void **state)
{
    static const uint64_t restarts = 0;
    (void)state;
    signal(SIGPIPE, SIG_IGN); /* a terminal that is gone gives an error; so shall the socket that stands for it */
    options = (struct base_options){.port = "port"};
    create_odometry_defaults(&options.odometry, CREATE_1);
    options.odometry.policy = CREATE_REPORTED;
    base_robot_begin(&robot, &options, on_step, &clients);
    base_clients_begin(&clients, &robot, &restarts);
    assert_true(base_robot_open(&robot, pair(SOCK_STREAM, &line), OPENED_MS));
    assert_true(base_clients_add(&clients, pair(SOCK_SEQPACKET, &commander)));
    assert_true(base_clients_add(&clients, pair(SOCK_SEQPACKET, &other)));
    say(commander, "drive 0.2 0", OPENED_MS);
    for (int64_t now_ms = OPENED_MS; now_ms < HEARD_MS; now_ms += CREATE_OI_PERIOD_MS) {
        tell_frame(SPEED_MM_S, FRAME_MM, now_ms + CREATE_OI_PERIOD_MS);
    }
    driven_m = 0;
    return 0;
}

static int end(void **state)
{
    (void)state;
    for (int i = 0; i < BASE_CLIENTS; i++) {
        if (clients.client[i].socket >= 0) {
            close(clients.client[i].socket);
        }
    }
    close(robot.port);
    close(line);
    close(commander);
    close(other);
    return 0;
}

/* The first frame after the silence says that the base stands: it drove until `stopped_ms`, to a frame. */
static void assert_driven_until(int64_t stopped_ms)
{
    tell_frame(0, 0, BACK_MS);
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

/* The wheels stood from the first stop on, whoever says it again. */
static void a_stop_said_again_changes_nothing(void **state)
{
    (void)state;
    say(commander, "stop", ORDERED_MS);
    say(commander, "stop", ORDERED_MS + 200);
    base_robot_watch(&robot, HEARD_MS + BASE_SILENCE_MS);
    say(commander, "drive 0.2 0", BACK_MS - 100); /* it is not driven blind */
    assert_driven_until(ORDERED_MS);
}

/* The cable is out: the base goes on as it was told last, until the port is back. */
static void a_stop_that_was_not_written_was_not_heard(void **state)
{
    (void)state;
    close(line);
    say(commander, "drive 0 0", ORDERED_MS);
    assert_int_equal(robot.port, -1);
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
        SILENCE(a_stop_said_again_changes_nothing),
        SILENCE(a_stop_that_was_not_written_was_not_heard),
    };
    return cmocka_run_group_tests_name("base silence", tests, NULL, NULL);
}
