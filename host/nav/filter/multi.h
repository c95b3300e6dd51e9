/* Several weighted Gaussians, and how they split, merge and die: the beliefs of the `multi` filter. */
#ifndef NAV_MULTI_H
#define NAV_MULTI_H

#include "filter.h"
#include "gaussian.h"

struct multi_mode {
    struct nav_gaussian belief;
    double weight;
};

struct multi_modes {
    struct multi_mode *at;
    int count, room;
};

/* Scales weights to sum 1; false when there is nothing to scale. */
bool multi_normalise(struct multi_modes *);

/* Drops modes lighter than `least` of all, the heaviest never; call on normalised weights. */
void multi_prune(struct multi_modes *, double least);

/* Merges pairs whose means are closer than `near` standard deviations, lighter into heavier, moments kept. */
void multi_merge(struct multi_modes *, double near);

/* Makes modes of a mixture: each bump joins the mode that it is near, or begins one while there is room. */
void multi_gather(struct multi_modes *, const struct nav_component *, long count);

/* Root of a covariance: lower triangular, row-major; a matrix that is not positive definite loses what is not. */
void multi_root(const double covariance[9], double root[9]);

/* Weighted poses: n of them, as offsets [n][3] from a mean, and weights that sum to 1. */
struct multi_points {
    const double *offset, *weight;
    int count;
};

/* Mean and covariance of points about `from`. */
struct nav_gaussian multi_fit(struct nav_pose from, const struct multi_points *);

/* Cuts points where their projection on the longest axis falls best into two heaps, weights of the one then 0 in
 * out[n]; false when the heaps explain less than `share` of the axis's variance. A normal distribution gives 2 / pi, an
 * even one 3 / 4. */
bool multi_split(const struct multi_points *, double share, double *out);

#endif
