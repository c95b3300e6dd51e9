#include "whisker_base_log.h"

#include <stdarg.h>
#include <stdio.h>
#include <time.h>

bool base_log_pass(struct base_log_limit *limit, int64_t now_ms, unsigned *hidden)
{
    *hidden = 0;
    if (limit->said == 0 || now_ms - limit->since_ms >= BASE_LOG_MS) {
        *hidden = limit->hidden;
        *limit = (struct base_log_limit){.since_ms = now_ms};
    }
    if (limit->said == BASE_LOG_LINES) {
        limit->hidden++;
        return false;
    }
    limit->said++;
    return true;
}

static int64_t log_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

void base_log(struct base_log_limit *limit, enum daemon_priority priority, const char *format, ...)
{
    char line[400];
    unsigned hidden;
    va_list arguments;
    if (!base_log_pass(limit, log_now_ms(), &hidden)) {
        return;
    }
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    if (hidden > 0) {
        daemon_log(priority, "%s (%u lines like this one were left out)", line, hidden);
    } else {
        daemon_log(priority, "%s", line);
    }
}
