/* What a filter is given: the arena, the robot, the belief to begin from, rows; and what it answers. */
#ifndef NAV_PROBLEM_H
#define NAV_PROBLEM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "arena.h"
#include "pose.h"
#include "settings.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
/* A component of a Gaussian mixture: normal in x and y (sigma_m each) and in heading, independent. */
struct nav_component {
    struct nav_pose pose;
    double sigma_m, sigma_rad;
    double mass;
};

enum { NAV_COMPONENTS_MOST = 10000 };

/* Belief before the first row. uniform: over free space, all else unused. components above 0: their mixture, as a
 * filter listed it, in place of mean and sigma, with NAV_ANYWHERE of the mass uniform. Clipped to free space each way.
 */
struct nav_prior {
    bool uniform;
    struct nav_pose mean;
    double sigma[3]; /* x, y m; theta rad; above 0 */
    /* [components] within the arena, widths above 0, masses of any sum above 0 */
    const struct nav_component *component;
    long components; /* at most NAV_COMPONENTS_MOST */
};

struct nav_problem {
    struct nav_arena arena;
    struct nav_robot robot;
    struct nav_prior prior;
    struct nav_settings settings;
    uint64_t seed; /* of every random draw: same seed, same rows, same bytes out */
};

/* One row, 0.1 s (docs/formats.md: observations.csv). A NaN texture (first class), distance or first value of a sensor
 * of the user's own was not read. */
struct nav_row {
    double t_s;
    double odometry[3];    /* motion since the previous row in its frame: x, y m, theta rad; infinite: it was carried */
    const double *texture; /* [tips][classes] log-likelihood of the window */
    const double *radial_m; /* [rays] distance of contact; INFINITY: read, no contact */
    const double *normal;   /* [rays][2] of the surface that is touched, with `normals` of the robot: direction of the
                               outward normal, robot's frame, -2 pi to 2 pi, and its standard deviation, above 0 up to
                               pi; a direction of NaN: not read. NULL: none is */
    const double *own;      /* readings of the robot's own sensors, one after another */
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

/* What is wrong with a prior, NULL when nothing is; *which: the component that it is wrong with, -1: none of them
 * alone. */
const char *nav_prior_fault(const struct nav_arena *, const struct nav_prior *, long *which);
/* cffi: end */

/* Radius and angle of `confidence`. */
#define NAV_NEAR_M 0.25
#define NAV_NEAR_RAD 0.5

/* Share of the mass that a stored mixture loses to "anywhere": between storing and loading the robot may have been
 * carried off. A restart in a hundred is far more than a filter that was there doubts (motion.hazard, per row), and
 * little enough that a belief which was right stays the answer. Filters that hold one Gaussian, or a few, cannot keep
 * it. */
#define NAV_ANYWHERE 0.01

/* The share that is anywhere after a row says that the robot was carried. Its base says so of hands and of frames that
 * a bad line has altered, and nobody has counted which is more frequent. */
#define NAV_CARRIED 0.5

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
