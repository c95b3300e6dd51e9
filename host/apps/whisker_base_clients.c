#include "whisker_base_clients.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "daemon_log.h"

#define ANSWER 1024
_Static_assert(BASE_MESSAGE == 256, "the answer to a longer message says so");

void base_clients_begin(struct base_clients *clients, struct base_robot *robot, const uint64_t *restarts)
{
    *clients = (struct base_clients){.robot = robot, .restarts = restarts};
    for (int i = 0; i < BASE_CLIENTS; i++) {
        clients->client[i].socket = -1;
    }
}

bool base_clients_add(struct base_clients *clients, int socket)
{
    for (int i = 0; i < BASE_CLIENTS; i++) {
        if (clients->client[i].socket < 0) {
            clients->client[i] = (struct base_client){.socket = socket, .bits = base_robot_bits(clients->robot)};
            return true;
        }
    }
    daemon_log(LOG_WARN, "more than %d clients; one turned away", BASE_CLIENTS);
    close(socket);
    return false;
}

/* A commander that goes leaves standing wheels behind. */
static void drop(struct base_clients *clients, struct base_client *client)
{
    close(client->socket);
    *client = (struct base_client){.socket = -1};
    if (clients->commander == client) {
        clients->commander = NULL;
        daemon_log(LOG_NOTE, "the commander has gone; wheels stopped");
        base_robot_stop(clients->robot, clients->now_ms);
    }
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

static void answer(struct base_clients *clients, struct base_client *client, const char *text)
{
    if (send(client->socket, text, strlen(text), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) {
        drop(clients, client); /* gone, or it does not read */
    }
}

static void answer_sent(struct base_clients *clients, struct base_client *client)
{
    char text[ANSWER];
    const struct base_robot *robot = clients->robot;
    snprintf(text, sizeof text, "sent %llu %.9g %.9g", (unsigned long long)robot->sent, robot->speeds.v_m_s,
             robot->speeds.omega_rad_s);
    answer(clients, client, text);
}

static bool may_command(struct base_clients *clients, struct base_client *client)
{
    if (!clients->commander) {
        clients->commander = client;
    }
    if (clients->commander != client) {
        answer(clients, client, "error another client commands; end that one first");
    }
    return clients->commander == client;
}

/* Reads the number at *text and goes on behind it. */
static bool read_number(const char **text, double *value)
{
    char *end;
    *value = strtod(*text, &end);
    const bool read = end != *text && isfinite(*value);
    *text = end;
    return read;
}

static void on_drive(struct base_clients *clients, struct base_client *client, const char *text)
{
    double v, omega;
    if (!read_number(&text, &v) || !read_number(&text, &omega) || *text != '\0') {
        answer(clients, client, "error say: drive V OMEGA, in m/s and rad/s");
    } else if (may_command(clients, client)) {
        base_robot_drive(clients->robot, v, omega, clients->now_ms);
        answer_sent(clients, client);
    }
}

static void on_mode(struct base_clients *clients, struct base_client *client, const char *text)
{
    static const char *const names[] = {" passive", " safe", " full"};
    for (int i = 0; i < 3; i++) {
        if (!strcmp(text, names[i])) {
            if (may_command(clients, client)) {
                base_robot_mode(clients->robot, (enum create_oi_mode)(CREATE_OI_MODE_PASSIVE + i), clients->now_ms);
                answer_sent(clients, client);
            }
            return;
        }
    }
    answer(clients, client, "error say: mode passive, mode safe or mode full");
}

static void on_odometry(struct base_clients *clients, struct base_client *client)
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
    answer(clients, client, text);
}

static void on_health(struct base_clients *clients, struct base_client *client)
{
    char text[ANSWER];
    int at = snprintf(text, sizeof text, "health driver_pid=%d guard_pid=%d restarts=%llu commander=%d ", (int)getpid(),
                      (int)getppid(), (unsigned long long)*clients->restarts, clients->commander != NULL);
    base_robot_health(clients->robot, text + at, sizeof text - (size_t)at);
    answer(clients, client, text);
}

static void obey(struct base_clients *clients, struct base_client *client)
{
    const char *text = client->message;
    client->waits = false;
    if (!strncmp(text, "drive ", 6)) {
        on_drive(clients, client, text + 6);
    } else if (!strncmp(text, "mode", 4)) {
        on_mode(clients, client, text + 4);
    } else if (!strcmp(text, "odometry")) {
        on_odometry(clients, client);
    } else if (!strcmp(text, "stop")) { /* anybody may */
        base_robot_stop(clients->robot, clients->now_ms);
        answer_sent(clients, client);
    } else if (!strcmp(text, "health")) {
        on_health(clients, client);
    } else {
        answer(clients, client, "error say: drive V OMEGA, stop, odometry, mode NAME or health");
    }
}

/* Cuts " after N" off a message; false: there is none. */
static bool cut_after(char *text, uint64_t *after)
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
static ssize_t receive(struct base_client *client)
{
    const size_t room = sizeof client->message - 1;
    const ssize_t got = recv(client->socket, client->message, room, MSG_DONTWAIT | MSG_TRUNC);
    client->message[got > 0 && (size_t)got < room ? (size_t)got : room] = '\0';
    return got;
}

static void take_message(struct base_clients *clients, struct base_client *client)
{
    const ssize_t got = receive(client);
    if (got <= 0) {
        if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
            drop(clients, client);
        }
        return;
    }
    if ((size_t)got >= sizeof client->message) { /* its beginning may say something else */
        answer(clients, client, "error message too long; 255 letters are the most");
    } else if (strlen(client->message) != (size_t)got) {
        answer(clients, client, "error message with a zero byte; say letters only");
    } else if (cut_after(client->message, &client->after)) {
        client->leads = client->waits = true;
    } else {
        obey(clients, client);
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
            drop(clients, client);
        } else if (!client->waits && polled[i].revents) {
            take_message(clients, client);
        }
        if (client->waits && (clients->robot->port < 0 || base_robot_taken(clients->robot) >= client->after)) {
            obey(clients, client);
        }
    }
}
