/*
 * libFuzzer target: whatever clients of whisker-base send, and whatever comes from the base meanwhile, every message
 * has one answer, the line carries whole orders within the wheels' limits, and wheels only turn for a commander that is
 * connected. Input: one byte of options; then steps, each a byte of what and by whom, and what that needs.
 */
#include <errno.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "create/model.h"
#include "daemon_log.h"
#include "whisker_base_clients.h"

#define CLIENTS (BASE_CLIENTS + 2) /* more than there are places for */
#define LINE_BYTES 4096
#define ANSWER_BYTES 1100
#define COUNT(array) (sizeof(array) / sizeof(array)[0])

/* Of the first, numbers follow. */
static const char *const phrases[] = {"drive",     "drive 0.2 0.1", "stop",   "mode safe",
                                      "mode full", "mode passive",  "health", "odometry"};
static const char *const numbers[] = {"0",    "0.2", "-0.5", "1e308", "-1e308", "nan",
                                      "-inf", "0x",  "1e-9", "9999",  "+.5",    "0.0005"};

struct input {
    const uint8_t *at;
    size_t left;
};

struct far { /* the other ends: of the clients' sockets and of the serial line */
    int client[CLIENTS], line;
    int pending[CLIENTS]; /* answers */
};

static struct base_options options;
static struct base_robot robot;
static struct base_clients clients;
static struct far far;
static int64_t now_ms;

void daemon_log(enum daemon_priority priority, const char *format, ...)
{
    char line[512]; /* the arguments are looked at, nothing is reported */
    va_list arguments;
    (void)priority;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
}

static void demand(int truth)
{
    if (!truth) {
        abort();
    }
}

static unsigned take(struct input *input)
{
    if (input->left == 0) {
        return 0;
    }
    input->left--;
    return *input->at++;
}

static int pair(int type, int *theirs)
{
    int ends[2];
    demand(socketpair(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) == 0);
    *theirs = ends[1];
    return ends[0];
}

/* ----------------------------------------------------------------------------------------------- what must always hold
 */

static int word(const uint8_t *bytes)
{
    return (int16_t)(uint16_t)(bytes[0] << 8 | bytes[1]);
}

/* One order at the beginning of the bytes, whole and sound. Returns its length. */
static size_t check_order(const uint8_t *bytes, size_t count)
{
    switch (bytes[0]) {
    case CREATE_OI_OP_DRIVE_DIRECT:
        demand(count >= 5 && abs(word(bytes + 1)) <= CREATE_OI_SPEED_MAX_MM_S &&
               abs(word(bytes + 3)) <= CREATE_OI_SPEED_MAX_MM_S);
        return 5;
    case CREATE_OI_OP_STREAM:
        demand(count >= 2u + bytes[1]);
        return 2u + bytes[1];
    default:
        demand(bytes[0] == 0 || bytes[0] == CREATE_OI_OP_START || bytes[0] == CREATE_OI_OP_SAFE ||
               bytes[0] == CREATE_OI_OP_FULL);
        return 1;
    }
}

static void check_line(void)
{
    static uint8_t bytes[LINE_BYTES];
    ssize_t got;
    while (far.line >= 0 && (got = recv(far.line, bytes, sizeof bytes, 0)) > 0) {
        for (size_t at = 0; at < (size_t)got;) {
            at += check_order(bytes + at, (size_t)got - at);
        }
    }
}

static int served(void)
{
    int count = 0;
    for (int i = 0; i < BASE_CLIENTS; i++) {
        count += clients.client[i].socket >= 0;
    }
    return count;
}

static void check_answers(void)
{
    char text[ANSWER_BYTES];
    for (int i = 0; i < CLIENTS; i++) {
        ssize_t got;
        while (far.client[i] >= 0 && (got = recv(far.client[i], text, sizeof text - 1, 0)) >= 0) {
            if (got == 0) { /* its place was needed, or there was none */
                demand(served() >= BASE_CLIENTS - 1 || far.pending[i] == 0);
                close(far.client[i]);
                far.client[i] = -1;
                far.pending[i] = 0;
                break;
            }
            text[got] = '\0';
            demand(strlen(text) == (size_t)got && far.pending[i]-- > 0);
            demand(!strncmp(text, "sent ", 5) || !strncmp(text, "error ", 6) || !strncmp(text, "odometry ", 9) ||
                   !strncmp(text, "health ", 7));
        }
    }
}

static void check_wheels(void)
{
    const struct base_client *commander = clients.commander;
    demand(!commander || commander->socket >= 0);
    demand(commander || (robot.speeds.left_mm_s == 0 && robot.speeds.right_mm_s == 0));
    demand(!base_robot_kept(&robot) || (robot.speeds.left_mm_s == 0 && robot.speeds.right_mm_s == 0));
}

/* ----------------------------------------------------------------------------------------------------------- the steps
 */

static void connect_client(int i)
{
    if (far.client[i] >= 0) {
        close(far.client[i]);
    }
    far.pending[i] = base_clients_add(&clients, pair(SOCK_SEQPACKET, &far.client[i]), now_ms) ? 0 : 1; /* why not */
}

static void connect_all(void)
{
    for (int i = 0; i < CLIENTS; i++) {
        connect_client(i);
    }
}

static void say(int i, const char *bytes, size_t count)
{
    if (far.client[i] >= 0 && count > 0 && send(far.client[i], bytes, count, MSG_NOSIGNAL) > 0) {
        far.pending[i]++;
    }
}

static size_t append(char *text, size_t length, size_t room, const char *word)
{
    return length + (size_t)snprintf(text + length, room - length, "%s%s", length ? " " : "", word);
}

static void say_phrase(struct input *input, int i)
{
    char text[128], after[32];
    const unsigned what = take(input) % COUNT(phrases), more = take(input);
    size_t length = append(text, 0, sizeof text, phrases[what]);
    for (int n = 0; n < 2 && what == 0; n++) {
        length = append(text, length, sizeof text, numbers[take(input) % COUNT(numbers)]);
    }
    if (more & 1) {
        snprintf(after, sizeof after, "after %u", take(input));
        length = append(text, length, sizeof text, after);
    }
    say(i, text, length);
}

/* Bytes as they are, up to twice as many as a message may have. */
static void say_anything(struct input *input, int i)
{
    char bytes[2 * BASE_MESSAGE];
    size_t count = 2u * take(input);
    for (size_t n = 0; n < count; n++) {
        bytes[n] = (char)take(input);
    }
    say(i, bytes, count);
}

/* A frame of the stream, made good, so that odometry and modes are in it. */
static void report_frame(struct input *input)
{
    const struct create_stream *stream = &robot.stream;
    uint8_t frame[CREATE_STREAM_BYTES], sum = 0;
    for (size_t i = 0; i + 1 < stream->length; i++) {
        frame[i] = stream->known[i] ? stream->expected[i] : (uint8_t)take(input);
        sum = (uint8_t)(sum + frame[i]);
    }
    frame[stream->length - 1] = (uint8_t)-sum;
    if (far.line >= 0) {
        send(far.line, frame, stream->length, MSG_NOSIGNAL);
    }
}

static void report_anything(struct input *input)
{
    uint8_t bytes[16];
    const size_t count = take(input) % sizeof bytes;
    for (size_t n = 0; n < count; n++) {
        bytes[n] = (uint8_t)take(input);
    }
    if (far.line >= 0) {
        send(far.line, bytes, count, MSG_NOSIGNAL);
    }
}

/* The cable is pulled, or put back. */
static void handle_cable(void)
{
    if (far.line >= 0) {
        close(far.line);
        far.line = -1;
    } else if (robot.port < 0) {
        base_robot_open(&robot, pair(SOCK_STREAM, &far.line), now_ms);
    }
}

/* The heartbeat is lost, or the machine goes to sleep; or that is over. */
static void hold(unsigned what)
{
    base_robot_hold(&robot, what & 32 ? BASE_HOLD_SLEEP : BASE_HOLD_HEARTBEAT, what & 64, now_ms);
}

static void act(struct input *input)
{
    const unsigned what = take(input);
    const int i = (int)(take(input) % CLIENTS);
    switch (what & 7) {
    case 0:
        say_anything(input, i);
        break;
    case 1:
        what & 8 ? connect_all() : connect_client(i);
        break;
    case 2:
        now_ms += 4 * (int64_t)take(input);
        break;
    case 3:
        report_frame(input);
        break;
    case 4:
        what & 8 ? handle_cable() : what & 16 ? hold(what) : report_anything(input);
        break;
    default:
        say_phrase(input, i);
    }
}

/* As the driver does after each sleep. */
static void serve(void)
{
    struct pollfd polled[BASE_CLIENTS];
    const uint64_t limit = base_clients_limit(&clients);
    if (robot.port >= 0 && base_robot_taken(&robot) < limit) {
        base_robot_read(&robot, limit, now_ms);
    }
    base_robot_watch(&robot, now_ms);
    base_clients_poll(&clients, polled);
    while (poll(polled, BASE_CLIENTS, 0) < 0) { /* libFuzzer's clock has interrupted it */
        demand(errno == EINTR);
    }
    base_clients_serve(&clients, polled, now_ms);
}

static void begin(unsigned kind)
{
    static const uint64_t restarts = 3;
    options = (struct base_options){.port = "port", .full = kind & 1, .stream_clock = kind & 2};
    create_odometry_defaults(&options.odometry, kind & 4 ? CREATE_2 : CREATE_1);
    now_ms = 1000;
    base_robot_begin(&robot, &options, base_clients_step, &clients);
    base_clients_begin(&clients, &robot, &restarts);
    demand(base_robot_open(&robot, pair(SOCK_STREAM, &far.line), now_ms));
    for (int i = 0; i < CLIENTS; i++) {
        far.client[i] = -1;
        far.pending[i] = 0;
    }
    connect_client(0);
    connect_client(1);
}

static int pending(void)
{
    int sum = 0;
    for (int i = 0; i < CLIENTS; i++) {
        sum += far.pending[i];
    }
    return sum;
}

/* Without a line nothing is waited for: all that was asked is answered. */
static void answer_all(void)
{
    if (far.line >= 0) {
        close(far.line);
    }
    for (int rounds = 2 * pending() + 2; rounds > 0; rounds--) { /* one takes a message, one answers it */
        serve();
        check_answers();
    }
    demand(pending() == 0);
}

static void end(void)
{
    if (robot.port >= 0) {
        base_robot_end(&robot, now_ms);
    }
    for (int i = 0; i < BASE_CLIENTS; i++) {
        if (clients.client[i].socket >= 0) {
            close(clients.client[i].socket);
        }
    }
    for (int i = 0; i < CLIENTS; i++) {
        if (far.client[i] >= 0) {
            close(far.client[i]);
        }
    }
}

/* A terminal that is gone gives an error and no signal; so shall the socket that stands for it. */
int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc;
    (void)argv;
    return signal(SIGPIPE, SIG_IGN) == SIG_ERR;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct input input = {data, size};
    begin(take(&input));
    while (input.left > 0) {
        act(&input);
        serve();
        check_line();
        check_answers();
        check_wheels();
    }
    answer_all();
    end();
    return 0;
}
