/* Filters: where the robot is, from rows of odometry and whisker readings. One table of functions per filter. */
#ifndef NAV_FILTER_H
#define NAV_FILTER_H

#include "problem.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_filter;

/* Name of filter number `index`, NULL beyond the last. */
const char *nav_filter_name(int index);

/* Copies the problem, arrays included. NULL: unknown name, a prior with a fault, or no memory. */
struct nav_filter *nav_filter_new(const char *name, const struct nav_problem *);
void nav_filter_free(struct nav_filter *);

/* Begins again from another prior, as a new filter of the same problem does: nothing learned is kept. NULL, or what is
 * wrong with the prior; the filter then stays as it is. Allocates. */
const char *nav_filter_reset(struct nav_filter *, const struct nav_prior *);

/* Takes one row and says where the robot is at its end. Any row is allowed: what is not finite or out of range is
 * counted and treated as not read. Does not allocate. */
void nav_filter_step(struct nav_filter *, const struct nav_row *, struct nav_estimate *);

/* The belief after the last row as components whose masses sum to 1: the first `room` of them go to `out`. Returns how
 * many there are, which may exceed `room`. For judging and drawing, not for the timed path. */
long nav_filter_components(const struct nav_filter *, struct nav_component *out, long room);

/* How finely a filter divides the arena, and how finely its sensors resolve it; 0: it has no cells. A cell
 * above `wanted_m` is what its budget allows. start_m: cells in which it looks for a place that is not known at all,
 * where these are too wide for its sensors; else 0. */
struct nav_resolution {
    double m, rad, wanted_m, start_m;
};
struct nav_resolution nav_filter_resolution(const struct nav_filter *);

uint64_t nav_filter_bad_cells(const struct nav_filter *);
uint64_t nav_filter_bad_rows(const struct nav_filter *); /* repeated, late or reordered */
/* cffi: end */

struct nav_evidence;
struct nav_motion;

/* What a filter is. `self` is its own; the problem outlives it. */
struct nav_filter_ops {
    const char *name;
    void *(*create)(const struct nav_problem *);
    void (*destroy)(void *self);
    void (*predict)(void *self, const struct nav_motion *);    /* every row: integrates, may put work off */
    void (*update)(void *self, const struct nav_evidence *);   /* rows with something new to read */
    void (*estimate)(const void *self, struct nav_estimate *); /* every row; work counts: of the last update */
    long (*components)(const void *self, struct nav_component *out, long room); /* as nav_filter_components */
    struct nav_resolution (*resolution)(const void *self);                      /* NULL: it has no cells */
};

extern const struct nav_filter_ops nav_odometry_filter; /* dead reckoning from the prior's mean */
extern const struct nav_filter_ops nav_ekf_filter;      /* Kalman: ranges and border crossings, derivatives */
extern const struct nav_filter_ops nav_foveal_filter;   /* the paper's, equations 5-7 */
extern const struct nav_filter_ops nav_grid_filter;     /* exact, equation 4 */
extern const struct nav_filter_ops nav_particle_filter; /* Monte-Carlo localisation */
extern const struct nav_filter_ops nav_adaptive_filter; /* as much belief as the rows leave open */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
