#include "daemon_notify.h"

#ifdef WHISKER_SYSTEMD
#include <stdbool.h>
#include <stdint.h>
#include <systemd/sd-daemon.h>
#include <time.h>

void daemon_notify_ready(const char *status)
{
    sd_notifyf(0, "READY=1\nSTATUS=%s", status);
}

static uint64_t now_us(void)
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
    if (period_us > 0 && now_us() - fed_us >= period_us) {
        fed_us = now_us();
        sd_notify(0, "WATCHDOG=1");
    }
}

void daemon_notify_stopping(void)
{
    sd_notify(0, "STOPPING=1");
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
