#include "whisker_base_guard.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "cli.h"
#include "create/port.h"
#include "daemon_log.h"
#include "daemon_notify.h"
#include "heartbeat.h"
#include "whisker_base_driver.h"
#include "whisker_base_log.h"
#include "whisker_base_robot.h"
#include "whisker_base_socket.h"

/* A driver that dies so young is not started again at once. */
#define YOUNG_MS 200
#define PAUSE_MS 500
/* Between two looks at the driver, two leases for it, and two feedings of the watchdog: at most. */
#define LOOK_MS 50
/* For so long a stop is tried again when a driver has ended without one. */
#define END_MS 500

struct guard {
    const struct base_options *options;
    int listening, port, driver; /* sockets and the driver's port; -1: none */
    pid_t child;
    uint64_t restarts;
    int64_t heard_ms;
    bool stuck;
    bool stood;                 /* a stop was written since the driver was heard last */
    bool drove;                 /* there was a port */
    struct heartbeat heartbeat; /* of the supervisor */
    bool orphaned;              /* the supervisor has ended */
    struct base_log_limit log_hang, log_death;
};

/* ---------------------------------------------------------------------------------------------------------- the wheels
 */

/* Writes a stop; false: there is no port, or no room in it. */
static bool whisker_base_guard_stop_wheels(struct guard *guard)
{
    if (guard->port >= 0) {
        create_port_set_baud(guard->port, guard->options->baud); /* the driver may have called at another speed */
    }
    guard->stood = guard->port >= 0 && create_port_stop(guard->port);
    return guard->stood;
}

/* Stops the wheels when a driver has ended, whatever it has done. False: nobody could, and a base was driven. */
static bool whisker_base_guard_stop_at_end(struct guard *guard, int status)
{
    const struct timespec pause = {.tv_nsec = BASE_RETRY_MS * 1000000};
    const bool stopped = WIFEXITED(status) && WEXITSTATUS(status) != BASE_TURNING;
    for (int64_t until_ms = cli_now_ms() + END_MS;
         !whisker_base_guard_stop_wheels(guard) && guard->port >= 0 && !stopped && cli_now_ms() < until_ms;) {
        nanosleep(&pause, NULL);
    }
    return stopped || guard->stood || !guard->drove;
}

static const char *whisker_base_guard_fate(bool stopped)
{
    return stopped ? "ordered to stop" : "no stop could be written: the wheels may turn; switch the base off";
}

static void whisker_base_guard_hold_port(struct guard *guard, int port)
{
    if (guard->port >= 0) {
        create_port_close(guard->port);
    }
    guard->port = port;
    guard->drove |= port >= 0;
}

/* ---------------------------------------------------------------------------------------------------------- the driver
 */

/* The descriptor that came with a message; -1: none. */
static int whisker_base_guard_descriptor_of(struct msghdr *message)
{
    int port = -1;
    struct cmsghdr *header = CMSG_FIRSTHDR(message);
    if (header && header->cmsg_level == SOL_SOCKET && header->cmsg_type == SCM_RIGHTS) {
        memcpy(&port, CMSG_DATA(header), sizeof port);
    }
    return port;
}

/* One message of the driver; false: it has died. */
static bool whisker_base_guard_hear(struct guard *guard)
{
    char byte;
    union {
        struct cmsghdr header;
        char room[CMSG_SPACE(sizeof(int))];
    } control;
    struct iovec part = {.iov_base = &byte, .iov_len = 1};
    struct msghdr message = {
        .msg_iov = &part, .msg_iovlen = 1, .msg_control = control.room, .msg_controllen = sizeof control.room};
    const ssize_t got = recvmsg(guard->driver, &message, MSG_CMSG_CLOEXEC);
    if (got <= 0) {
        return got < 0 && errno == EINTR;
    }
    guard->heard_ms = cli_now_ms();
    guard->stuck = guard->stood = false;
    if (byte == BASE_PORT || byte == BASE_NO_PORT) {
        whisker_base_guard_hold_port(guard, whisker_base_guard_descriptor_of(&message));
        daemon_notify_ready(byte == BASE_PORT ? "drives the base" : "waiting for the port");
    }
    return true;
}

static struct base_lease whisker_base_guard_lease_of(const struct guard *guard)
{
    const int64_t own_ms = cli_now_ms() + BASE_STUCK_MS, supervisor_ms = heartbeat_until_ms(&guard->heartbeat);
    return (struct base_lease){own_ms < supervisor_ms ? own_ms : supervisor_ms};
}

/* In lock-step simulation time stands still between messages: there the wheels go by their frames alone. */
static void whisker_base_guard_send_lease(const struct guard *guard)
{
    const struct base_lease lease = whisker_base_guard_lease_of(guard);
    if (!guard->options->stream_clock) {
        send(guard->driver, &lease, sizeof lease, MSG_NOSIGNAL | MSG_DONTWAIT);
    }
}

static void whisker_base_guard_be_driver(const struct guard *guard, int socket)
{
    const struct base_driver_start start = {.options = guard->options,
                                            .lease = whisker_base_guard_lease_of(guard),
                                            .guard = socket,
                                            .listening = guard->listening,
                                            .port = guard->port,
                                            .restarts = guard->restarts};
    _exit(base_driver_run(&start));
}

static bool whisker_base_guard_start_driver(struct guard *guard)
{
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
        return false;
    }
    guard->heard_ms = cli_now_ms();
    guard->child = fork();
    if (guard->child == 0) {
        close(ends[0]);
        close(guard->heartbeat.fd);
        whisker_base_guard_be_driver(guard, ends[1]);
    }
    close(ends[1]);
    guard->driver = ends[0];
    return guard->child > 0;
}

/* A driver that hangs cannot stop the wheels: it is done for it, and in the end it is ended. */
static void whisker_base_guard_watch_driver(struct guard *guard)
{
    const int64_t silent_ms = cli_now_ms() - guard->heard_ms;
    if (silent_ms < BASE_STUCK_MS) {
        return;
    }
    if (!guard->stood && whisker_base_guard_stop_wheels(guard) && guard->stuck) {
        base_log(&guard->log_hang, LOG_WARN, "the driver hangs; %s", whisker_base_guard_fate(true));
    }
    if (!guard->stuck) {
        guard->stuck = true;
        base_log(&guard->log_hang, LOG_WARN, "the driver hangs; %s", whisker_base_guard_fate(guard->stood));
    }
    if (silent_ms >= BASE_DEAD_MS) {
        kill(guard->child, SIGKILL);
    }
}

/* Passes on the wish to stop; from now on the driver has to end, also one without a deadline for signs of life. */
static void whisker_base_guard_end_driver(struct guard *guard)
{
    daemon_notify_stopping();
    guard->heard_ms = guard->options->stream_clock ? cli_now_ms() : guard->heard_ms;
    kill(guard->child, SIGTERM);
}

/* What the supervisor's pipe has for us. */
static void whisker_base_guard_hear_supervisor(struct guard *guard)
{
    if (!heartbeat_read(&guard->heartbeat, cli_now_ms())) {
        guard->orphaned = true;
        daemon_log(LOG_ERROR, "the supervisor has ended; ending");
    }
}

/* Sleeps until the driver or the supervisor says something, something is due, or a signal has come; false: the driver
 * has died, or cannot be watched any more. */
static bool whisker_base_guard_look(struct guard *guard, bool timed)
{
    enum { DRIVER, SUPERVISOR, POLLED };
    sigset_t none;
    sigemptyset(&none);
    struct pollfd polled[POLLED] = {{.fd = guard->driver, .events = POLLIN},
                                    {.fd = guard->heartbeat.fd, .events = POLLIN}};
    const struct timespec due = {.tv_nsec = LOOK_MS * 1000000L};
    const int ready = ppoll(polled, POLLED, &due, &none);
    if (ready < 0 && errno != EINTR) {
        daemon_log(LOG_ERROR, "cannot watch the driver: %s; ending", strerror(errno));
        return false;
    }
    if (ready > 0 && polled[SUPERVISOR].revents) {
        whisker_base_guard_hear_supervisor(guard);
    }
    const bool lives = ready <= 0 || !polled[DRIVER].revents || whisker_base_guard_hear(guard);
    if (timed && lives) {
        whisker_base_guard_watch_driver(guard);
    }
    whisker_base_guard_send_lease(guard);
    daemon_notify_alive();
    return lives;
}

/* Waits for the driver's end. Returns its status as of waitpid(). */
static int whisker_base_guard_attend(struct guard *guard)
{
    bool reported = false;
    int status = 0;
    do {
        if ((cli_stop_wanted() || guard->orphaned) && !reported) {
            reported = true;
            whisker_base_guard_end_driver(guard);
        }
    } while (whisker_base_guard_look(guard, reported || !guard->options->stream_clock));
    close(guard->driver);
    waitpid(guard->child, &status, 0);
    return status;
}

static void whisker_base_guard_pause_after(const struct guard *guard, int64_t begun_ms)
{
    sigset_t none;
    sigemptyset(&none);
    if (cli_now_ms() - begun_ms < YOUNG_MS && guard->restarts > 1) {
        const struct timespec pause = {.tv_nsec = PAUSE_MS * 1000000L};
        ppoll(NULL, 0, &pause, &none);
    }
}

/* What whisker-base ends with after its last driver. */
static int whisker_base_guard_exit_code(int status, bool stopped)
{
    if (!stopped) {
        daemon_log(LOG_ERROR, "%s", whisker_base_guard_fate(stopped));
        return CLI_FAILED;
    }
    return WIFEXITED(status) && WEXITSTATUS(status) != BASE_TURNING ? WEXITSTATUS(status) : CLI_OK;
}

/* Drivers one after the other, until one ends by itself. */
static int whisker_base_guard_keep_driver(struct guard *guard)
{
    while (whisker_base_guard_start_driver(guard)) {
        const int64_t begun_ms = cli_now_ms();
        const int status = whisker_base_guard_attend(guard);
        const bool stopped = whisker_base_guard_stop_at_end(guard, status);
        if (WIFEXITED(status) || cli_stop_wanted() || guard->orphaned) {
            return whisker_base_guard_exit_code(status, stopped);
        }
        guard->restarts++;
        base_log(&guard->log_death, LOG_ERROR, "the driver has died (signal %d); %s, starting it again",
                 WTERMSIG(status), whisker_base_guard_fate(stopped));
        whisker_base_guard_pause_after(guard, begun_ms);
    }
    daemon_log(LOG_ERROR, "cannot start the driver: %s", strerror(errno));
    return CLI_FAILED;
}

/* Signals are taken only where a process waits, so that none slips between looking and waiting. */
static void whisker_base_guard_block_signals(void)
{
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGHUP);
    sigprocmask(SIG_BLOCK, &signals, NULL);
}

int base_guard_run(const struct base_options *options)
{
    struct guard guard = {.options = options, .listening = -1, .port = -1, .driver = -1};
    whisker_base_guard_block_signals();
    if (!heartbeat_begin(&guard.heartbeat, cli_now_ms())) {
        daemon_log(LOG_ERROR,
                   HEARTBEAT_VARIABLE "=%s: no open descriptor; give it the read end of the supervisor's pipe, "
                                      "or unset it",
                   getenv(HEARTBEAT_VARIABLE));
        return CLI_USAGE;
    }
    struct base_socket clients;
    if (!base_socket_open(&clients, options->socket)) {
        return CLI_FAILED;
    }
    guard.listening = clients.listening;
    const int code = whisker_base_guard_keep_driver(&guard);
    whisker_base_guard_hold_port(&guard, -1);
    base_socket_close(&clients);
    return code;
}
