/* Filters: where the robot is, from rows of odometry and whisker readings. One table of functions per filter. */
#ifndef NAV_FILTER_H
#define NAV_FILTER_H

#include <stddef.h>
#include <stdint.h>

#include "arena.h"
#include "pose.h"
#include "settings.h"

/* cffi: begin */
/* A bump of belief: normal in x and y (sigma_m each) and in heading, independent. */
struct nav_component {
    struct nav_pose pose;
    double sigma_m, sigma_rad;
    double mass;
};

enum { NAV_BUMPS_MOST = 10000 };

/* Belief before the first row. uniform: over free space, all else unused. bumps above 0: their mixture, as a filter
 * listed it, in place of mean and sigma, with NAV_ANYWHERE of the mass uniform. Clipped to free space each way. */
struct nav_prior {
    bool uniform;
    struct nav_pose mean;
    double sigma[3];                  /* x, y m; theta rad; above 0 */
    const struct nav_component *bump; /* [bumps] within the arena, widths above 0, masses of any sum above 0 */
    long bumps;                       /* at most NAV_BUMPS_MOST */
};

struct nav_problem {
    struct nav_arena arena;
    struct nav_robot robot;
    struct nav_prior prior;
    struct nav_settings settings;
    uint64_t seed; /* of every random draw: same seed, same rows, same bytes out */
};

/* One row, 0.1 s (contracts: observations.csv). A NaN texture (first class) or distance was not read. */
struct nav_row {
    double t_s;
    double odometry[3];     /* motion since the previous row in its frame: x, y m, theta rad */
    const double *texture;  /* [tips][classes] log-likelihood of the window */
    const double *radial_m; /* [rays] distance of contact; INFINITY: read, no contact */
};

struct nav_estimate {
    struct nav_pose pose;
    double covariance[9]; /* row-major, x, y m, theta rad, about the pose */
    double confidence;    /* belief mass within 0.25 m and 0.5 rad of the pose */
    long evaluations;     /* poses, cells or hypotheses weighted for this row */
    long distinct;        /* expected observations (signatures) whose likelihood was worked out for this row */
    long touched;         /* cells, particles or hypotheses moved or weighted for this row: the work */
    long states;          /* how many it holds */
    size_t bytes;         /* and in how much memory, tables included */
};

struct nav_filter;

/* Name of filter number `index`, NULL beyond the last. */
const char *nav_filter_name(int index);

/* What is wrong with a prior, NULL when nothing is; *which: the bump that it is wrong with, -1: none of them alone. */
const char *nav_prior_fault(const struct nav_arena *, const struct nav_prior *, long *which);

/* Copies the problem, arrays included. NULL: unknown name, a prior with a fault, or no memory. */
struct nav_filter *nav_filter_new(const char *name, const struct nav_problem *);
void nav_filter_free(struct nav_filter *);

/* Takes one row and says where the robot is at its end. Any row is allowed: what is not finite or out of range is
 * counted and treated as not read. Does not allocate. */
void nav_filter_step(struct nav_filter *, const struct nav_row *, struct nav_estimate *);

/* The belief after the last row as bumps whose masses sum to 1: the first `room` of them go to `out`. Returns how many
 * there are, which may exceed `room`. For judging and drawing, not for the timed path. */
long nav_filter_components(const struct nav_filter *, struct nav_component *out, long room);

uint64_t nav_filter_bad_cells(const struct nav_filter *);
uint64_t nav_filter_bad_rows(const struct nav_filter *); /* repeated, late or reordered */
/* Windows that call all textures equally likely: not bad, but treated as not read. */
uint64_t nav_filter_empty_windows(const struct nav_filter *);
/* cffi: end */

/* Radius and angle of `confidence`. */
#define NAV_NEAR_M 0.25
#define NAV_NEAR_RAD 0.5

/* Share of the mass that a mixture is doubted by: whoever kept it was not there when the robot may have been carried
 * off. A restart in a hundred is far more than a filter that was there doubts (adaptive.hazard, per row), and little
 * enough that a belief which was right stays the answer. Filters that hold one Gaussian, or a few, cannot keep it. */
#define NAV_ANYWHERE 0.01

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
};

extern const struct nav_filter_ops nav_odometry_filter; /* dead reckoning from the prior's mean */
extern const struct nav_filter_ops nav_ekf_filter;      /* Kalman: ranges and border crossings, derivatives */
extern const struct nav_filter_ops nav_ukf_filter;      /* the same by the unscented transform */
extern const struct nav_filter_ops nav_foveal_filter;   /* the paper's, equations 5-7 */
extern const struct nav_filter_ops nav_grid_filter;     /* exact, equation 4 */
extern const struct nav_filter_ops nav_particle_filter; /* Monte-Carlo localisation */
extern const struct nav_filter_ops nav_adaptive_filter; /* as much belief as the rows leave open */
extern const struct nav_filter_ops nav_multi_filter;    /* several Gaussians with weights */

#endif
