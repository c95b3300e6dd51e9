/* Waiting with a limit, in milliseconds of the monotonic clock. */
#ifndef WHISKER_RING_TIME_H
#define WHISKER_RING_TIME_H

#include <stdint.h>
#include <time.h>

static inline int64_t ring_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* How long to sleep now: at most `step`, at most what is left of the timeout (negative: no limit); 0 when that is over.
 */
static inline int ring_sleep_ms(int timeout_ms, int64_t started_ms, int step)
{
    if (timeout_ms < 0) {
        return step;
    }
    const int64_t left = timeout_ms - (ring_now_ms() - started_ms);
    return left <= 0 ? 0 : left < step ? (int)left : step;
}

#endif
