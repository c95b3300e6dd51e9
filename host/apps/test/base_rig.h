/*
 * whisker-base without its processes, for tests: robot and clients by a clock of the test's own, the far ends of serial
 * line and sockets in the test's hands.
 */
#ifndef TEST_BASE_RIG_H
#define TEST_BASE_RIG_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "whisker_base_clients.h"

static struct base_options options;
static struct base_robot robot;
static struct base_clients clients;
static int line;           /* the far end */
static unsigned log_lines; /* since the rig was begun */
static char log_line[400]; /* the newest */

void daemon_log(enum daemon_priority priority, const char *format, ...)
{
    va_list arguments;
    (void)priority;
    va_start(arguments, format);
    vsnprintf(log_line, sizeof log_line, format, arguments);
    va_end(arguments);
    log_lines++;
}

static inline int pair(int type, int *theirs)
{
    int ends[2];
    assert_int_equal(socketpair(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
    *theirs = ends[1];
    return ends[0];
}

static inline void serve(int64_t now_ms)
{
    struct pollfd polled[BASE_CLIENTS];
    base_clients_poll(&clients, polled);
    assert_true(poll(polled, BASE_CLIENTS, 0) >= 0);
    base_clients_serve(&clients, polled, now_ms);
}

/* The line carries away what was written to it. */
static inline void carry_away(void)
{
    char bytes[4096];
    while (recv(line, bytes, sizeof bytes, 0) > 0) {
    }
}

static inline void say(int client, const char *message, int64_t now_ms)
{
    assert_int_equal(send(client, message, strlen(message), 0), strlen(message));
    carry_away();
    serve(now_ms);
}

/* One frame of a base in this mode that was asked for this speed, and in it moved so far. Returns its bytes. */
static inline size_t make_frame(int mode, int asked_mm_s, int moved_mm, uint8_t frame[CREATE_STREAM_BYTES])
{
    uint8_t sum = 0;
    int32_t value[CREATE_OI_PACKET_MAX + 1] = {[CREATE_OI_MODE] = mode,
                                               [CREATE_OI_DISTANCE] = moved_mm,
                                               [CREATE_OI_REQUESTED_LEFT] = asked_mm_s,
                                               [CREATE_OI_REQUESTED_RIGHT] = asked_mm_s,
                                               [CREATE_OI_VOLTAGE] = 14000,
                                               [CREATE_OI_CHARGE] = 2000,
                                               [CREATE_OI_CAPACITY] = 2700};
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
    return stream->length;
}

static inline void report(int mode, int asked_mm_s, int moved_mm, int64_t now_ms)
{
    uint8_t frame[CREATE_STREAM_BYTES];
    const size_t count = make_frame(mode, asked_mm_s, moved_mm, frame);
    carry_away();
    assert_int_equal(send(line, frame, count, 0), count);
    assert_true(base_robot_read(&robot, UINT64_MAX, now_ms));
}

static inline void report_frame(int asked_mm_s, int moved_mm, int64_t now_ms)
{
    report(CREATE_OI_MODE_SAFE, asked_mm_s, moved_mm, now_ms);
}

/* A Create 1 that has been opened, without clients: nothing was heard of it yet. */
static inline void open_rig(bool stream_clock, base_on_step *on_step, int64_t now_ms)
{
    static const uint64_t restarts = 0;
    signal(SIGPIPE, SIG_IGN); /* a terminal that is gone gives an error; so shall the socket that stands for it */
    options = (struct base_options){.port = "port", .stream_clock = stream_clock};
    create_odometry_defaults(&options.odometry, CREATE_1);
    options.odometry.policy = CREATE_REPORTED;
    base_robot_begin(&robot, &options, on_step, &clients);
    base_clients_begin(&clients, &robot, &restarts);
    assert_true(base_robot_open(&robot, pair(SOCK_STREAM, &line), now_ms));
    log_lines = 0;
}

/* It has entered its mode by now. */
static inline void begin_rig(bool stream_clock, base_on_step *on_step, int64_t now_ms)
{
    open_rig(stream_clock, on_step, now_ms - 2 * CREATE_OI_PERIOD_MS);
    report(CREATE_OI_MODE_PASSIVE, 0, 0, now_ms - CREATE_OI_PERIOD_MS);
    report_frame(0, 0, now_ms);
    carry_away();
}

static inline void end_rig(void)
{
    for (int i = 0; i < BASE_CLIENTS; i++) {
        if (clients.client[i].socket >= 0) {
            close(clients.client[i].socket);
        }
    }
    close(robot.port);
    close(line);
}

#endif
