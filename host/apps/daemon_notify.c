#include "daemon_notify.h"

#ifdef WHISKER_SYSTEMD
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>
#include <time.h>
#include <unistd.h>

/* Does what sd_notify() does, but never waits: a daemon must not hang with a manager that hangs. */
static void daemon_notify_notify(const char *text)
{
    const char *path = getenv("NOTIFY_SOCKET");
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (!path || strlen(path) < 2 || strlen(path) >= sizeof address.sun_path) {
        return;
    }
    memcpy(address.sun_path, path, strlen(path));
    address.sun_path[0] = path[0] == '@' ? '\0' : path[0];
    const int manager = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (manager >= 0) {
        sendto(manager, text, strlen(text), MSG_NOSIGNAL, (const struct sockaddr *)&address,
               (socklen_t)(offsetof(struct sockaddr_un, sun_path) + strlen(path)));
        close(manager);
    }
}

void daemon_notify_ready(const char *status)
{
    char text[256];
    snprintf(text, sizeof text, "READY=1\nSTATUS=%s", status);
    daemon_notify_notify(text);
}

static uint64_t daemon_notify_now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

/* At a quarter of the time after which systemd would end us. */
void daemon_notify_alive(void)
{
    static uint64_t period_us, fed_us;
    static bool asked;
    if (!asked) {
        asked = true;
        period_us = sd_watchdog_enabled(0, &period_us) > 0 ? period_us / 4 : 0;
    }
    if (period_us > 0 && daemon_notify_now_us() - fed_us >= period_us) {
        fed_us = daemon_notify_now_us();
        daemon_notify_notify("WATCHDOG=1");
    }
}

void daemon_notify_stopping(void)
{
    daemon_notify_notify("STOPPING=1");
}
#else
void daemon_notify_ready(const char *status)
{
    (void)status;
}

void daemon_notify_alive(void)
{
}

void daemon_notify_stopping(void)
{
}
#endif
