/* The adaptive filter's least belief: one Gaussian, and whether it estimates the pose as well as particles would.
 *
 * It is corrected as by the extended Kalman filter. Beside that the full likelihood of every row is looked up at a few
 * points of the Gaussian, which gives three figures: how well it explained the row, for the kidnap test
 * (adaptive_kidnap.h) and for a comparison with the particles; the row's information beyond what was known, where a
 * product of many weak factors stays normal and one of few strong ones does not; and whether a wider Gaussian would
 * have explained the rows better. */
#ifndef NAV_ADAPTIVE_GAUSSIAN_H
#define NAV_ADAPTIVE_GAUSSIAN_H

#include "kalman.h"
#include "particles.h"

struct adaptive_gaussian {
    struct nav_kalman kalman;
    bool carries;    /* it is all that is held of the robot's place */
    double reported; /* nats that the last rows carried, fading */
    double wider;    /* log-ratio of rows by the wider Gaussian and by this one; at least 0 (Page's test) */
    double behind;   /* log-ratio of rows by the particles and by this one, since the comparison began */
    int compared;    /* rows since then, below 0 until the next; 0: none is under way */
    long looked;     /* expected observations worked out for the last row */
};

/* 0, or -1 without memory; adaptive_gaussian_free either way. The likelihood is the filter's own. */
int adaptive_gaussian_init(struct adaptive_gaussian *, const struct nav_problem *, struct nav_likelihood *);
void adaptive_gaussian_free(struct adaptive_gaussian *);

/* Begins from a belief, with nothing against it. */
void adaptive_gaussian_begin(struct adaptive_gaussian *, const struct nav_gaussian *);

/* Moves and takes the row that the likelihood has read. mass: as nav_particles_weigh. Returns the row's log-likelihood
 * where it carries or is compared. */
double adaptive_gaussian_take(struct adaptive_gaussian *, const struct nav_pending *, const struct nav_evidence *,
                              double mass);

/* Whether particles are to take its place. */
bool adaptive_gaussian_fails(const struct adaptive_gaussian *);

/* Takes a row's log-likelihood by the particles and by itself; true once it has predicted as well for long enough. */
bool adaptive_gaussian_compare(struct adaptive_gaussian *, double particles, double own);

/* Replaces the particles by draws from it: `count`, or as many times more as it is to be wider. */
void adaptive_gaussian_draw(const struct adaptive_gaussian *, struct nav_particles *, struct nav_rng *, long count);

#endif
