/* What the Kalman filters share: a row's readings as scalar sightings, and the correction by one of them. An extended
 * and an unscented filter differ only in how they linearise. */
#ifndef NAV_KALMAN_H
#define NAV_KALMAN_H

#include "borders.h"
#include "filter.h"
#include "gaussian.h"
#include "likelihood.h"

struct nav_sighting {
    int ray;              /* a contact along this object whisker; -1: a border crossed */
    struct nav_tip point; /* crossing: robot frame */
    bool upright;         /* crossing: the border is a line x = z, else y = z */
    double z, variance;   /* m, m^2; "no contact" is a distance of the whisker's length, looked up no further */
    double reach;         /* contact: ranges are looked up to here, m */
};

/* A sighting about the belief, to first and second moments: what is expected, its variance without the sighting's own,
 * and its covariance with x, y, theta. */
struct nav_linear {
    double expected, variance, cross[3];
};

struct nav_kalman;
typedef bool nav_linearise(struct nav_kalman *, const struct nav_sighting *, struct nav_linear *);

struct nav_kalman {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood; /* for the texture models */
    double *weight;                    /* [whiskers] of the row, object whiskers left out */
    struct nav_borders borders;
    struct nav_gaussian belief;
    nav_linearise *linearise; /* false: the sighting cannot be expected there */
    long evaluations;         /* expected observations worked out for the last row */
};

/* NULL: no memory. */
struct nav_kalman *nav_kalman_new(const struct nav_problem *, nav_linearise *);

/* Expected value of a sighting at a pose; INFINITY when nothing is within reach. Counts as an evaluation. */
double nav_kalman_expect(struct nav_kalman *, const struct nav_sighting *, struct nav_pose);

/* Corrects the belief by one sighting unless it is further off than three standard deviations. */
void nav_kalman_correct(struct nav_kalman *, const struct nav_sighting *);

/* The functions of nav_filter_ops that both filters have in common, and their places in the table. */
void nav_kalman_destroy(void *self);
void nav_kalman_predict(void *self, const struct nav_motion *);
void nav_kalman_update(void *self, const struct nav_evidence *);
void nav_kalman_estimate(const void *self, struct nav_estimate *);
long nav_kalman_components(const void *self, struct nav_component *out, long room);
#define NAV_KALMAN_OPS                                                                                                 \
    .destroy = nav_kalman_destroy, .predict = nav_kalman_predict, .update = nav_kalman_update,                         \
    .estimate = nav_kalman_estimate, .components = nav_kalman_components

#endif
