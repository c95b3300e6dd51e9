#include "whisker_base_clients.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "whisker_base_orders.h"

#define ANSWER 1024
_Static_assert(BASE_MESSAGE == 256, "the answer to a longer message says so");

void base_clients_begin(struct base_clients *clients, struct base_robot *robot, const uint64_t *restarts)
{
    *clients = (struct base_clients){.robot = robot, .restarts = restarts};
    for (int i = 0; i < BASE_CLIENTS; i++) {
        clients->client[i].socket = -1;
    }
}

/* A commander that goes leaves standing wheels behind. */
static void whisker_base_clients_drop(struct base_clients *clients, struct base_client *client)
{
    close(client->socket);
    *client = (struct base_client){.socket = -1};
    if (clients->commander == client) {
        clients->commander = NULL;
        base_robot_stop(clients->robot, clients->now_ms);
        base_robot_change_commander(clients->robot, false, clients->now_ms);
        base_log(&clients->log_commander, LOG_NOTE, "the commander has gone; %s", base_robot_fate(clients->robot));
    }
}

/* ---------------------------------------------------------------------------------------------------------- the places
 */

/* Whether there is a commander that has ordered something of late. */
static bool whisker_base_clients_commanded(const struct base_clients *clients)
{
    const bool silent = clients->robot->options->stream_clock
                            ? base_robot_frames(clients->robot) - clients->ordered_frame >= BASE_PLACE_FRAMES
                            : clients->now_ms - clients->ordered_ms >= BASE_PLACE_MS;
    return clients->commander && !silent;
}

static bool whisker_base_clients_keeps_place(const struct base_clients *clients, const struct base_client *client)
{
    return (client == clients->commander && whisker_base_clients_commanded(clients)) ||
           (client->leads && clients->robot->options->stream_clock);
}

/* Whether the one of two clients that are to lose their places does so first. */
static bool whisker_base_clients_before(const struct base_client *a, const struct base_client *b)
{
    return a->manners != b->manners ? a->manners < b->manners : a->heard_ms < b->heard_ms;
}

static bool whisker_base_clients_has_spoken(const struct base_client *client)
{
    char byte;
    return recv(client->socket, &byte, 1, MSG_PEEK | MSG_DONTWAIT) > 0;
}

/* Whether a client has had its time. What a new one has said may not have been read yet. */
static bool whisker_base_clients_has_had_time(const struct base_client *client, int64_t now_ms)
{
    const int64_t silent_ms = now_ms - client->heard_ms;
    switch (client->manners) {
    case BASE_NEW:
        return silent_ms >= BASE_SPEAK_MS && !whisker_base_clients_has_spoken(client);
    case BASE_KNOWN:
        return silent_ms >= BASE_PLACE_MS;
    default:
        return true;
    }
}

/* Number of an empty place, or of the client that is first to lose its own; -1: nobody does. *speaks: there is a client
 * that has said nothing yet, and still has time to. */
static int whisker_base_clients_find_place(const struct base_clients *clients, int64_t now_ms, bool *speaks)
{
    int found = -1;
    *speaks = false;
    for (int i = 0; i < BASE_CLIENTS; i++) {
        const struct base_client *client = &clients->client[i];
        if (client->socket < 0) {
            return i;
        }
        const bool over =
            whisker_base_clients_has_had_time(client, now_ms) && !whisker_base_clients_keeps_place(clients, client);
        *speaks |= client->manners == BASE_NEW && !over;
        if (over && (found < 0 || whisker_base_clients_before(client, &clients->client[found]))) {
            found = i;
        }
    }
    return found;
}

bool base_clients_crowded(const struct base_clients *clients, int64_t now_ms)
{
    bool speaks;
    return whisker_base_clients_find_place(clients, now_ms, &speaks) < 0 && speaks;
}

static void whisker_base_clients_turn_away(struct base_clients *clients, int socket)
{
    char text[80];
    snprintf(text, sizeof text, "error %d clients are connected; end one of them first", BASE_CLIENTS);
    send(socket, text, strlen(text), MSG_NOSIGNAL | MSG_DONTWAIT);
    close(socket);
    base_log(&clients->log_places, LOG_WARN, "more than %d clients; one turned away", BASE_CLIENTS);
}

bool base_clients_add(struct base_clients *clients, int socket, int64_t now_ms)
{
    bool speaks;
    const int found = whisker_base_clients_find_place(clients, now_ms, &speaks);
    if (found < 0) {
        whisker_base_clients_turn_away(clients, socket);
        return false;
    }
    struct base_client *place = &clients->client[found];
    if (place->socket >= 0) {
        base_log(&clients->log_places, LOG_WARN, "more than %d clients; one that said nothing of late lost its place",
                 BASE_CLIENTS);
        whisker_base_clients_drop(clients, place);
    }
    *place = (struct base_client){
        .socket = socket, .manners = BASE_NEW, .heard_ms = now_ms, .bits = base_robot_bits(clients->robot)};
    return true;
}

void base_clients_step(void *context, const struct create_step *step, unsigned bits)
{
    struct base_clients *clients = context;
    for (int i = 0; i < BASE_CLIENTS; i++) {
        if (clients->client[i].socket >= 0) {
            create_motion_add(&clients->client[i].motion, step);
            clients->client[i].bits |= bits;
        }
    }
}

uint64_t base_clients_limit(const struct base_clients *clients)
{
    uint64_t limit = 0;
    bool led = false;
    for (int i = 0; i < BASE_CLIENTS; i++) {
        const struct base_client *client = &clients->client[i];
        led |= client->leads;
        limit = client->leads && client->after > limit ? client->after : limit;
    }
    return led && clients->robot->options->stream_clock ? limit : UINT64_MAX;
}

/* ------------------------------------------------------------------------------------------------------- the messages
 */

static void whisker_base_clients_note_manners(struct base_client *client, bool good, int64_t now_ms)
{
    if (good) {
        client->manners = BASE_KNOWN;
        client->heard_ms = now_ms;
    } else if (client->manners == BASE_NEW) {
        client->manners = BASE_NONSENSE;
    }
}

static void whisker_base_clients_answer(struct base_clients *clients, struct base_client *client, const char *text)
{
    whisker_base_clients_note_manners(client, strncmp(text, "error", 5) != 0, clients->now_ms);
    if (send(client->socket, text, strlen(text), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) {
        whisker_base_clients_drop(clients, client); /* gone, or it does not read */
    }
}

static void whisker_base_clients_answer_sent(struct base_clients *clients, struct base_client *client)
{
    char text[ANSWER];
    const struct base_robot *robot = clients->robot;
    if (base_orders_may_turn(robot)) {
        snprintf(text, sizeof text, "error %s; check the adapter, or switch the base off", base_robot_fate(robot));
        whisker_base_clients_answer(clients, client, text);
        return;
    }
    snprintf(text, sizeof text, "sent %llu %.9g %.9g", (unsigned long long)robot->sent, robot->speeds.v_m_s,
             robot->speeds.omega_rad_s);
    whisker_base_clients_answer(clients, client, text);
}

static void whisker_base_clients_note_order(struct base_clients *clients)
{
    clients->ordered_ms = clients->now_ms;
    clients->ordered_frame = base_robot_frames(clients->robot);
}

static bool whisker_base_clients_may_command(struct base_clients *clients, struct base_client *client)
{
    if (!whisker_base_clients_commanded(clients) && clients->commander != client) {
        clients->commander = client;
        base_robot_change_commander(clients->robot, true, clients->now_ms);
    }
    if (clients->commander != client) {
        whisker_base_clients_answer(clients, client, "error another client commands; end that one first");
        return false;
    }
    whisker_base_clients_note_order(clients);
    return true;
}

/* Reads the number at *text and goes on behind it. */
static bool whisker_base_clients_read_number(const char **text, double *value)
{
    char *end;
    *value = strtod(*text, &end);
    const bool read = end != *text && isfinite(*value);
    *text = end;
    return read;
}

static void whisker_base_clients_on_drive(struct base_clients *clients, struct base_client *client, const char *text)
{
    double v, omega;
    if (!whisker_base_clients_read_number(&text, &v) || !whisker_base_clients_read_number(&text, &omega) ||
        *text != '\0') {
        whisker_base_clients_answer(clients, client, "error say: drive V OMEGA, in m/s and rad/s");
    } else if (whisker_base_clients_may_command(clients, client)) {
        base_robot_drive(clients->robot, v, omega, clients->now_ms);
        whisker_base_clients_answer_sent(clients, client);
    }
}

/* Anybody may. */
static void whisker_base_clients_on_stop(struct base_clients *clients, struct base_client *client)
{
    if (client == clients->commander) {
        whisker_base_clients_note_order(clients);
    }
    base_robot_stop(clients->robot, clients->now_ms);
    whisker_base_clients_answer_sent(clients, client);
}

static void whisker_base_clients_on_mode(struct base_clients *clients, struct base_client *client, const char *text)
{
    static const char *const names[] = {" passive", " safe", " full"};
    for (int i = 0; i < 3; i++) {
        if (!strcmp(text, names[i])) {
            if (whisker_base_clients_may_command(clients, client)) {
                base_robot_mode(clients->robot, (enum create_oi_mode)(CREATE_OI_MODE_PASSIVE + i), clients->now_ms);
                whisker_base_clients_answer_sent(clients, client);
            }
            return;
        }
    }
    whisker_base_clients_answer(clients, client, "error say: mode passive, mode safe or mode full");
}

static void whisker_base_clients_on_odometry(struct base_clients *clients, struct base_client *client)
{
    char text[ANSWER];
    double c[3][3];
    const struct create_motion *motion = &client->motion;
    create_motion_covariance(motion, c);
    snprintf(text, sizeof text, "odometry %.17g %.17g %.17g %.9g %.9g %.9g %.9g %.9g %.9g %u", motion->x, motion->y,
             motion->theta, c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2],
             client->bits | (base_robot_kept(clients->robot) ? BASE_IDLE : 0u));
    client->motion = (struct create_motion){0};
    client->bits = base_robot_bits(clients->robot);
    whisker_base_clients_answer(clients, client, text);
}

static void whisker_base_clients_on_health(struct base_clients *clients, struct base_client *client)
{
    char text[ANSWER];
    int at = snprintf(text, sizeof text, "health driver_pid=%d guard_pid=%d restarts=%llu commander=%d ", (int)getpid(),
                      (int)getppid(), (unsigned long long)*clients->restarts, whisker_base_clients_commanded(clients));
    base_robot_health(clients->robot, text + at, sizeof text - (size_t)at);
    whisker_base_clients_answer(clients, client, text);
}

static void whisker_base_clients_obey(struct base_clients *clients, struct base_client *client)
{
    const char *text = client->message;
    client->waits = false;
    if (!strncmp(text, "drive ", 6)) {
        whisker_base_clients_on_drive(clients, client, text + 6);
    } else if (!strncmp(text, "mode", 4)) {
        whisker_base_clients_on_mode(clients, client, text + 4);
    } else if (!strcmp(text, "odometry")) {
        whisker_base_clients_on_odometry(clients, client);
    } else if (!strcmp(text, "stop")) {
        whisker_base_clients_on_stop(clients, client);
    } else if (!strcmp(text, "health")) {
        whisker_base_clients_on_health(clients, client);
    } else {
        whisker_base_clients_answer(clients, client, "error say: drive V OMEGA, stop, odometry, mode NAME or health");
    }
}

/* Cuts " after N" off a message; false: there is none. */
static bool whisker_base_clients_cut_after(char *text, uint64_t *after)
{
    char *word = strstr(text, " after "), *end;
    if (!word) {
        return false;
    }
    const unsigned long long number = strtoull(word + 7, &end, 10);
    if (*end != '\0' || end == word + 7) {
        return false;
    }
    *word = '\0';
    *after = number;
    return true;
}

/* Receives a message, ended by a zero. Returns its whole length, also of what has no room; 0 or -1 as recv() does. */
static ssize_t whisker_base_clients_receive(struct base_client *client)
{
    const size_t room = sizeof client->message - 1;
    const ssize_t got = recv(client->socket, client->message, room, MSG_DONTWAIT | MSG_TRUNC);
    client->message[got > 0 && (size_t)got < room ? (size_t)got : room] = '\0';
    return got;
}

static void whisker_base_clients_take_message(struct base_clients *clients, struct base_client *client)
{
    const ssize_t got = whisker_base_clients_receive(client);
    if (got <= 0) {
        if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
            whisker_base_clients_drop(clients, client);
        }
        return;
    }
    if ((size_t)got >= sizeof client->message) { /* its beginning may say something else */
        whisker_base_clients_answer(clients, client, "error message too long; 255 letters are the most");
    } else if (strlen(client->message) != (size_t)got) {
        whisker_base_clients_answer(clients, client, "error message with a zero byte; say letters only");
    } else if (whisker_base_clients_cut_after(client->message, &client->after)) {
        client->leads = client->waits = true;
    } else {
        whisker_base_clients_obey(clients, client);
    }
}

void base_clients_poll(const struct base_clients *clients, struct pollfd *polled)
{
    for (int i = 0; i < BASE_CLIENTS; i++) {
        const struct base_client *client = &clients->client[i];
        polled[i] = (struct pollfd){.fd = client->socket, .events = client->waits ? 0 : POLLIN};
    }
}

void base_clients_serve(struct base_clients *clients, const struct pollfd *polled, int64_t now_ms)
{
    clients->now_ms = now_ms;
    for (int i = 0; i < BASE_CLIENTS; i++) {
        struct base_client *client = &clients->client[i];
        if (client->socket < 0 || client->socket != polled[i].fd) {
            continue;
        }
        if (client->waits && polled[i].revents & (POLLHUP | POLLERR)) {
            whisker_base_clients_drop(clients, client);
        } else if (!client->waits && polled[i].revents) {
            whisker_base_clients_take_message(clients, client);
        }
        if (client->waits && (clients->robot->port < 0 || base_robot_taken(clients->robot) >= client->after)) {
            whisker_base_clients_obey(clients, client);
        }
    }
}
