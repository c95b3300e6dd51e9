/* A Gaussian corrected by scalar sightings as by the extended Kalman filter, for another filter that has a likelihood
 * and reads every row with it. */
#ifndef NAV_KALMAN_H
#define NAV_KALMAN_H

#include "borders.h"
#include "filter.h"
#include "gaussian.h"
#include "likelihood.h"

struct nav_kalman;
struct nav_kalman_sighting;
struct nav_kalman_linear;
typedef void nav_kalman_linearise(struct nav_kalman *, const struct nav_kalman_sighting *, struct nav_kalman_linear *);

struct nav_kalman {
    const struct nav_problem *problem;
    struct nav_gaussian belief;
    nav_kalman_linearise *linearise;   /* NULL: nothing is corrected, and what follows is unused */
    struct nav_likelihood *likelihood; /* for the texture models */
    double *weight;                    /* of a filter of its own: [whiskers] of the row, object whiskers left out */
    struct nav_borders borders;
    long evaluations; /* expected observations worked out for the last row */
};

/* Begins from the prior. 0, or -1 without memory; nav_borders_free(&k->borders) either way. */
int nav_kalman_init(struct nav_kalman *, const struct nav_problem *, struct nav_likelihood *);

/* Moves the belief, and what is known of borders with it. */
void nav_kalman_move(struct nav_kalman *, struct nav_pose step, const struct nav_noise *);

/* Corrects the belief by a row that the likelihood has read. */
void nav_kalman_take(struct nav_kalman *, const struct nav_evidence *);

#endif
