/* Many rows through one filter, with the CPU time of each: how filters are measured. The only reader of a clock here.
 */
#ifndef NAV_REPLAY_H
#define NAV_REPLAY_H

#include "filter.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
/* Rows as columns of numbers, row-major, as struct nav_row has them. */
struct nav_rows {
    const double *t_s;
    const double *odometry; /* [rows][3] */
    const double *texture;  /* [rows][texture_width] */
    const double *radial_m; /* [rows][radial_width] */
    const double *normal;   /* [rows][radial_width][2]; NULL: none was read */
    const double *own;      /* [rows][own_width] */
    long texture_width;     /* tips x classes */
    long radial_width;      /* rays */
    long own_width;         /* values of the robot's own sensors together */
};

/* Steps the filter through rows first .. first + count - 1: out[count], and step_us[count], the thread's CPU time of
 * each nav_filter_step in microseconds, one reading of the clock (some 0.2 us) included. */
void nav_replay(struct nav_filter *, const struct nav_rows *, long first, long count, struct nav_estimate *out,
                double *step_us);
/* cffi: end */

/* One row of them. */
struct nav_row nav_rows_at(const struct nav_rows *, long row);

#pragma GCC visibility pop

/* A step of any estimator: a filter's, a mapper's. */
typedef void nav_step(void *estimator, const struct nav_row *, struct nav_estimate *);

/* nav_replay for any estimator. */
void nav_replay_steps(nav_step *, void *estimator, const struct nav_rows *, long first, long count,
                      struct nav_estimate *out, double *step_us);

#ifdef __cplusplus
}
#endif

#endif
