/* The last rows that were read: motion, readings, and how the local belief explained them. What the arena-wide belief
 * has not yet seen waits here, and what it slept through can be gone over again. */
#ifndef NAV_ADAPTIVE_LOG_H
#define NAV_ADAPTIVE_LOG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "filter.h"
#include "likelihood.h"
#include "motion.h"

/* Rows kept; how many of them a job of the arena-wide belief may begin behind the last (the others are for those that
 * come while it runs); and how many behind it begins to read fewer. */
enum { ADAPTIVE_ROWS_KEPT = 256, ADAPTIVE_ROWS_BEHIND = 192, ADAPTIVE_ROWS_LATE = 48 };

/* Motion up to a row, then its readings. */
struct adaptive_entry {
    struct nav_pose step;
    struct nav_noise noise;
    double local; /* log-likelihood by the local belief */
    bool sharp;   /* it may not be read at another place (measurement.h) */
};

struct adaptive_log {
    size_t whiskers, width; /* doubles per row */
    uint64_t head;          /* rows ever written; kept: the last ADAPTIVE_ROWS_KEPT of them */
    struct adaptive_entry entry[ADAPTIVE_ROWS_KEPT];
    size_t *offset;         /* [whiskers] of its reading in a row */
    double *value;          /* [ADAPTIVE_ROWS_KEPT][width] */
    double *weight;         /* [ADAPTIVE_ROWS_KEPT][whiskers] */
    double *unknown;        /* [ADAPTIVE_ROWS_KEPT][whiskers] log-likelihoods where nothing is mapped */
    const double **reading; /* [whiskers] of the row last replayed */
    const struct nav_sensors *sensors;
};

/* 0, or -1 without memory; adaptive_log_free either way. */
int adaptive_log_init(struct adaptive_log *, const struct nav_sensors *);
void adaptive_log_free(struct adaptive_log *);

/* Writes a row, over the oldest; unknown[whiskers]: its log-likelihoods where nothing is mapped. */
void adaptive_log_write(struct adaptive_log *, struct nav_pose step, struct nav_noise, const struct nav_evidence *,
                        const double *unknown);

/* Number of the oldest row that a job may begin with. */
uint64_t adaptive_log_reach(const struct adaptive_log *);

struct adaptive_entry *adaptive_log_entry(struct adaptive_log *, uint64_t row);

/* A row's readings, until the next call. */
struct nav_evidence adaptive_log_replay(struct adaptive_log *, uint64_t row);

/* Motion from the end of row `from` - 1 to the end of the last. */
struct nav_pending adaptive_log_since(const struct adaptive_log *, uint64_t from);

size_t adaptive_log_bytes(const struct adaptive_log *);

#endif
