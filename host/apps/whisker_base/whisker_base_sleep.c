#include "whisker_base_sleep.h"

#define RETRY_MS 10000 /* between two looks for a bus or a lock that is not there */

#ifdef WHISKER_SYSTEMD
#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <systemd/sd-bus.h>
#include <unistd.h>

#include "daemon_log.h"

#define LOGIND "org.freedesktop.login1"
#define LOGIND_PATH "/org/freedesktop/login1"
#define LOGIND_MANAGER LOGIND ".Manager"
/* Messages taken in one turn: the driver has other things to do. */
#define TURN 16

static void sleep_log_missing(struct base_sleep *sleep, const char *why)
{
    if (!sleep->reported) {
        sleep->reported = true;
        daemon_log(LOG_DETAIL, "no notice from logind before the machine sleeps: %s", why);
    }
}

static void sleep_unlock(struct base_sleep *sleep)
{
    if (sleep->lock >= 0) {
        close(sleep->lock);
        sleep->lock = -1;
    }
}

static int sleep_on_lock(sd_bus_message *message, void *context, sd_bus_error *error)
{
    struct base_sleep *sleep = context;
    const sd_bus_error *refused = sd_bus_message_get_error(message);
    int lock;
    (void)error;
    sleep->asked = false;
    if (refused) {
        sleep_log_missing(sleep, refused->message ? refused->message : refused->name);
    } else if (sd_bus_message_read(message, "h", &lock) > 0 && !sleep->about_to) { /* too late for this time */
        sleep->lock = fcntl(lock, F_DUPFD_CLOEXEC, 0);
        sleep->reported = false;
        daemon_log(LOG_DETAIL, "logind gives notice before the machine sleeps");
    }
    return 0;
}

/* For sleep alone: logind up to version 252 at least asks polkit for lid switches where a lock names two things, which
 * a service may not have. A shutdown is announced all the same, and ends this process by SIGTERM before anything else
 * freezes. */
static void sleep_ask_lock(struct base_sleep *sleep)
{
    sleep->asked =
        sd_bus_call_method_async(sleep->bus, NULL, LOGIND, LOGIND_PATH, LOGIND_MANAGER, "Inhibit", sleep_on_lock, sleep,
                                 "ssss", "sleep", "whisker-base", "stops the wheels first", "delay") >= 0;
}

static void sleep_report(struct base_sleep *sleep, bool about_to)
{
    if (sleep->about_to != about_to) {
        sleep->about_to = about_to;
        sleep->on_sleep(sleep->context, about_to);
    }
}

/* PrepareForSleep and PrepareForShutdown: true, it begins; false, it is over. */
static int sleep_on_prepare(sd_bus_message *message, void *context, sd_bus_error *error)
{
    struct base_sleep *sleep = context;
    int about_to;
    (void)error;
    if (sd_bus_message_read(message, "b", &about_to) <= 0) {
        return 0;
    }
    sleep_report(sleep, about_to);
    if (about_to) {
        sleep_unlock(sleep);
    } else if (sleep->lock < 0 && !sleep->asked) {
        sleep_ask_lock(sleep);
    }
    return 0;
}

static int sleep_match(struct base_sleep *sleep, const char *signal)
{
    return sd_bus_match_signal_async(sleep->bus, NULL, LOGIND, LOGIND_PATH, LOGIND_MANAGER, signal, sleep_on_prepare,
                                     NULL, sleep);
}

/* A bus that is gone sends nothing any more, so nothing is held because of what it announced. */
static void sleep_lose(struct base_sleep *sleep, int error)
{
    sleep_log_missing(sleep, strerror(-error));
    sleep->bus = sd_bus_close_unref(sleep->bus);
    sleep->asked = false;
    sleep_unlock(sleep);
    sleep_report(sleep, false);
}

/* The notices are asked for before the lock: none is missed while it is held. */
static void sleep_open(struct base_sleep *sleep)
{
    int result = sd_bus_open_system(&sleep->bus);
    if (result < 0) {
        sleep->bus = NULL;
        sleep_log_missing(sleep, strerror(-result));
        return;
    }
    result = sleep_match(sleep, "PrepareForSleep");
    result = result < 0 ? result : sleep_match(sleep, "PrepareForShutdown");
    if (result < 0) {
        sleep_lose(sleep, result);
    } else {
        sleep_ask_lock(sleep);
    }
}

static void sleep_retry(struct base_sleep *sleep, int64_t now_ms)
{
    if (now_ms - sleep->tried_ms < RETRY_MS) {
        return;
    }
    sleep->tried_ms = now_ms;
    if (!sleep->bus) {
        sleep_open(sleep);
    } else if (sleep->lock < 0 && !sleep->asked && !sleep->about_to) {
        sleep_ask_lock(sleep);
    }
}

void base_sleep_begin(struct base_sleep *sleep, base_on_sleep *on_sleep, void *context, int64_t now_ms)
{
    *sleep = (struct base_sleep){.on_sleep = on_sleep, .context = context, .lock = -1, .tried_ms = now_ms};
    sleep_open(sleep);
}

/* Until the bus wants to be looked after, by its own clock; it gives no time when it has nothing to wait for. */
static int64_t sleep_bus_due_ms(const struct base_sleep *sleep, int64_t now_ms)
{
    uint64_t due_us;
    if (sd_bus_get_timeout(sleep->bus, &due_us) < 0 || due_us == UINT64_MAX) {
        return RETRY_MS;
    }
    const int64_t left_ms = (int64_t)(due_us / 1000) - now_ms;
    return left_ms < 0 ? 0 : left_ms < RETRY_MS ? left_ms : RETRY_MS;
}

int64_t base_sleep_poll(const struct base_sleep *sleep, struct pollfd *polled, int64_t now_ms)
{
    const int events = sleep->bus ? sd_bus_get_events(sleep->bus) : 0;
    *polled =
        (struct pollfd){.fd = sleep->bus ? sd_bus_get_fd(sleep->bus) : -1, .events = (short)(events < 0 ? 0 : events)};
    return sleep->bus ? sleep_bus_due_ms(sleep, now_ms) : RETRY_MS;
}

void base_sleep_serve(struct base_sleep *sleep, int64_t now_ms)
{
    int result = 1;
    for (int i = 0; i < TURN && result > 0 && sleep->bus; i++) {
        result = sd_bus_process(sleep->bus, NULL);
    }
    if (result < 0) {
        sleep_lose(sleep, result);
    }
    sleep_retry(sleep, now_ms);
}

void base_sleep_end(struct base_sleep *sleep)
{
    sleep_unlock(sleep);
    sleep->bus = sd_bus_close_unref(sleep->bus);
}
#else
void base_sleep_begin(struct base_sleep *sleep, base_on_sleep *on_sleep, void *context, int64_t now_ms)
{
    *sleep = (struct base_sleep){.on_sleep = on_sleep, .context = context, .lock = -1, .tried_ms = now_ms};
}

int64_t base_sleep_poll(const struct base_sleep *sleep, struct pollfd *polled, int64_t now_ms)
{
    (void)sleep;
    (void)now_ms;
    *polled = (struct pollfd){.fd = -1};
    return RETRY_MS;
}

void base_sleep_serve(struct base_sleep *sleep, int64_t now_ms)
{
    (void)sleep;
    (void)now_ms;
}

void base_sleep_end(struct base_sleep *sleep)
{
    (void)sleep;
}
#endif
