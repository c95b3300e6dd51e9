#include "whisker_base_driver.h"

#include <errno.h>
#include <signal.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "cli.h"
#include "create/port.h"
#include "daemon_log.h"
#include "whisker_base_clients.h"
#include "whisker_base_sleep.h"

#define ALIVE_MS 50
#define END_MS 500 /* for a stop to be written at the end; then it is the guard's turn */
#define ACCEPT_MS 100

enum { GUARD, LISTENING, PORT, BUS, CLIENTS, POLLED = CLIENTS + BASE_CLIENTS };

struct driver {
    struct base_driver_start start;
    struct base_robot robot;
    struct base_clients clients;
    struct base_sleep sleep;
    struct pollfd polled[POLLED];
    int reported_port; /* descriptor the guard holds too */
    int64_t alive_ms, tried_ms;
    bool opened;       /* the port was open before: the next time is a reconnect */
    int64_t accept_ms; /* until then no connection is taken: there was no descriptor for one */
    struct base_log_limit log;
};

/* Tells the guard one thing, with the port's descriptor where it is not negative. */
static void whisker_base_driver_report(const struct driver *driver, enum base_report what, int port)
{
    char byte = (char)what;
    union {
        struct cmsghdr header;
        char room[CMSG_SPACE(sizeof port)];
    } control = {.room = {0}};
    struct iovec part = {.iov_base = &byte, .iov_len = 1};
    struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1};
    if (port >= 0) {
        message.msg_control = control.room;
        message.msg_controllen = sizeof control.room;
        struct cmsghdr *header = CMSG_FIRSTHDR(&message);
        header->cmsg_level = SOL_SOCKET;
        header->cmsg_type = SCM_RIGHTS;
        header->cmsg_len = CMSG_LEN(sizeof port);
        memcpy(CMSG_DATA(header), &port, sizeof port);
    }
    sendmsg(driver->start.guard, &message, MSG_NOSIGNAL | (what == BASE_ALIVE ? MSG_DONTWAIT : 0));
}

static void whisker_base_driver_report_port(struct driver *driver)
{
    driver->reported_port = driver->robot.port;
    whisker_base_driver_report(driver, driver->reported_port < 0 ? BASE_NO_PORT : BASE_PORT, driver->reported_port);
}

static void whisker_base_driver_report_alive(struct driver *driver)
{
    if (!driver->start.options->stream_clock && cli_now_ms() - driver->alive_ms >= ALIVE_MS) {
        driver->alive_ms = cli_now_ms();
        whisker_base_driver_report(driver, BASE_ALIVE, -1);
    }
}

/* The port again, when there is none. */
static void whisker_base_driver_reopen(struct driver *driver)
{
    struct base_robot *robot = &driver->robot;
    if (robot->port >= 0 || cli_now_ms() - driver->tried_ms < BASE_REOPEN_MS) {
        return;
    }
    driver->tried_ms = cli_now_ms();
    if (base_robot_open(robot, -1, cli_now_ms())) {
        robot->reconnects += driver->opened;
        if (driver->opened) {
            base_log(&robot->log.back, LOG_NOTE, "%s: is back", robot->options->port);
        }
        driver->opened = true;
    }
}

static int64_t whisker_base_driver_least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* Whether connections are taken at the moment. */
static bool whisker_base_driver_accepts(const struct driver *driver)
{
    return cli_now_ms() >= driver->accept_ms && !base_clients_crowded(&driver->clients, cli_now_ms());
}

/* What is waited for. Returns for how many ms at most. */
static int64_t whisker_base_driver_fill(struct driver *driver)
{
    const bool wanted = base_robot_taken(&driver->robot) < base_clients_limit(&driver->clients);
    driver->polled[GUARD] = (struct pollfd){.fd = driver->start.guard, .events = POLLIN};
    driver->polled[LISTENING] =
        (struct pollfd){.fd = driver->start.listening, .events = whisker_base_driver_accepts(driver) ? POLLIN : 0};
    driver->polled[PORT] = (struct pollfd){.fd = driver->robot.port, .events = wanted ? POLLIN : 0};
    base_clients_poll(&driver->clients, &driver->polled[CLIENTS]);
    const int64_t sleep_ms = base_sleep_poll(&driver->sleep, &driver->polled[BUS], cli_now_ms());
    return whisker_base_driver_accepts(driver) ? sleep_ms : BASE_SPEAK_MS;
}

/* Takes the guard's newest lease. False: the guard has died. */
static bool whisker_base_driver_take_lease(struct driver *driver)
{
    struct base_lease lease;
    ssize_t got;
    while ((got = recv(driver->start.guard, &lease, sizeof lease, MSG_DONTWAIT)) == sizeof lease) {
        driver->start.lease = lease;
    }
    return got < 0 && (errno == EAGAIN || errno == EINTR);
}

/* Without a lease the wheels stand. Returns ms until the one that there is runs out. */
static int64_t whisker_base_driver_watch_lease(struct driver *driver)
{
    if (driver->start.options->stream_clock) {
        return ALIVE_MS;
    }
    const int64_t left_ms = driver->start.lease.until_ms - cli_now_ms();
    base_robot_hold(&driver->robot, BASE_HOLD_HEARTBEAT, left_ms <= 0, cli_now_ms());
    return left_ms > 0 ? left_ms : ALIVE_MS;
}

/* Sleeps until something comes or is due; signals end it. False: it cannot sleep so. */
static bool whisker_base_driver_await(struct driver *driver)
{
    sigset_t none;
    sigemptyset(&none);
    const int64_t watched_ms = whisker_base_driver_least(base_robot_watch(&driver->robot, cli_now_ms()),
                                                         whisker_base_driver_watch_lease(driver));
    const int64_t due = whisker_base_driver_least(watched_ms, whisker_base_driver_fill(driver));
    const bool untimed =
        driver->start.options->stream_clock && driver->robot.port >= 0 && whisker_base_driver_accepts(driver);
    const int64_t sleep_ms = whisker_base_driver_least(due, ALIVE_MS);
    const struct timespec timeout = {.tv_nsec = sleep_ms * 1000000};
    const int ready = ppoll(driver->polled, POLLED, untimed ? NULL : &timeout, &none);
    for (int i = 0; i < POLLED && ready < 0; i++) {
        driver->polled[i].revents = 0;
    }
    return ready >= 0 || errno == EINTR;
}

/* Takes a connection. False: there is none, or none can be taken; then it stays where it is, and is tried again later.
 */
static bool whisker_base_driver_accept_client(struct driver *driver)
{
    const int socket = accept4(driver->start.listening, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket >= 0) {
        base_clients_add(&driver->clients, socket, cli_now_ms());
        return true;
    }
    if (errno != EAGAIN && errno != EINTR && errno != ECONNABORTED) {
        driver->accept_ms = cli_now_ms() + ACCEPT_MS;
        base_log(&driver->log, LOG_WARN, "cannot take a client: %s; allow more (ulimit -n)", strerror(errno));
    }
    return false;
}

static void whisker_base_driver_serve(struct driver *driver)
{
    if (!driver->start.options->stream_clock) {
        base_sleep_serve(&driver->sleep, cli_now_ms());
    }
    const uint64_t limit = base_clients_limit(&driver->clients);
    if (driver->robot.port >= 0 && (driver->polled[PORT].revents || !driver->start.options->stream_clock)) {
        base_robot_read(&driver->robot, limit, cli_now_ms());
    }
    base_robot_watch(&driver->robot,
                     cli_now_ms()); /* a base that is not heard is stopped before a commander is obeyed */
    base_clients_serve(&driver->clients, &driver->polled[CLIENTS], cli_now_ms());
    if (driver->polled[LISTENING].revents) {
        for (int i = 0;
             i < BASE_CLIENTS && whisker_base_driver_accepts(driver) && whisker_base_driver_accept_client(driver);
             i++) {
        }
    }
    if (driver->reported_port != driver->robot.port) {
        whisker_base_driver_report_port(driver);
    }
    whisker_base_driver_report_alive(driver);
}

static void whisker_base_driver_on_sleep(void *context, bool about_to)
{
    struct driver *driver = context;
    base_robot_hold(&driver->robot, BASE_HOLD_SLEEP, about_to, cli_now_ms());
}

static bool whisker_base_driver_open_first(struct driver *driver)
{
    const struct base_driver_start *start = &driver->start;
    driver->tried_ms = cli_now_ms();
    driver->opened = base_robot_open(&driver->robot, start->port, cli_now_ms());
    driver->robot.unseen = start->restarts > 0;
    if (!driver->opened && !start->options->wait && start->restarts == 0) {
        return false;
    }
    whisker_base_driver_report_port(driver);
    return true;
}

/* Runs until it is asked to end, or has nothing to go on with. Returns the exit code. */
static int whisker_base_driver_run(struct driver *driver)
{
    while (!cli_stop_wanted()) {
        whisker_base_driver_reopen(driver);
        if (!whisker_base_driver_await(driver)) {
            const int error = errno;
            base_robot_stop(&driver->robot, cli_now_ms());
            daemon_log(LOG_ERROR, "cannot wait for %d descriptors: %s; %s, ending; allow more (ulimit -n)", POLLED,
                       strerror(error), base_robot_fate(&driver->robot));
            return CLI_FAILED;
        }
        if (driver->polled[GUARD].revents && !whisker_base_driver_take_lease(driver)) {
            base_robot_stop(&driver->robot, cli_now_ms());
            daemon_log(LOG_ERROR, "the guard has died; %s, ending", base_robot_fate(&driver->robot));
            return CLI_FAILED;
        }
        whisker_base_driver_watch_lease(driver); /* before a commander is obeyed */
        whisker_base_driver_serve(driver);
    }
    return CLI_OK;
}

/* Stops the wheels, as long as it takes, within bounds. False: no stop could be written to a base that was driven. */
static bool whisker_base_driver_end(struct driver *driver)
{
    const struct timespec pause = {.tv_nsec = BASE_RETRY_MS * 1000000};
    const int64_t until_ms = cli_now_ms() + END_MS;
    bool stopped = !driver->opened;
    while (!stopped && driver->robot.port >= 0 && cli_now_ms() < until_ms) {
        stopped = base_robot_end(&driver->robot, cli_now_ms());
        if (!stopped) {
            nanosleep(&pause, NULL);
        }
    }
    if (driver->robot.port >= 0) {
        create_port_close(driver->robot.port);
    }
    return stopped;
}

int base_driver_run(const struct base_driver_start *start)
{
    static struct driver driver;
    driver.start = *start;
    base_robot_begin(&driver.robot, start->options, base_clients_step, &driver.clients);
    base_clients_begin(&driver.clients, &driver.robot, &driver.start.restarts);
    if (!whisker_base_driver_open_first(&driver)) {
        return CLI_FAILED;
    }
    if (!start->options->stream_clock) { /* a simulation does not sleep */
        base_sleep_begin(&driver.sleep, whisker_base_driver_on_sleep, &driver, cli_now_ms());
    }
    const int code = whisker_base_driver_run(&driver);
    const bool stopped = whisker_base_driver_end(&driver);
    base_sleep_end(&driver.sleep);
    return stopped ? code : BASE_TURNING;
}
