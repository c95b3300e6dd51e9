/* Log lines that a client or a bad line to the base can cause again and again: a bound on each of them. */
#ifndef WHISKER_BASE_LOG_H
#define WHISKER_BASE_LOG_H

#include <stdbool.h>
#include <stdint.h>

#include "daemon_log.h"

/* So many lines of a kind in each minute; the others are counted. */
#define BASE_LOG_LINES 5
#define BASE_LOG_MS 60000

/* All zero: nothing was logged. */
struct base_log_limit {
    int64_t since_ms;      /* when the minute began */
    unsigned said, hidden; /* since then */
};

/* Whether one more line may be logged; *hidden: lines before it that were not. */
bool base_log_pass(struct base_log_limit *limit, int64_t now_ms, unsigned *hidden);

/* Logs as daemon_log() does, at a rate bounded in real time, whatever clock the wheels go by. */
__attribute__((format(printf, 3, 4))) void base_log(struct base_log_limit *limit, enum daemon_priority priority,
                                                    const char *format, ...);

#endif
