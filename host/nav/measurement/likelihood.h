/* All sensors of a robot: expected codes at a pose, and the likelihood of a row of readings given codes. */
#ifndef NAV_LIKELIHOOD_H
#define NAV_LIKELIHOOD_H

#include "map_belief.h"
#include "sensing.h"
#include "trust.h"

/* One row's readings, sensors in the order of struct nav_sensors. */
struct nav_evidence {
    const double *const *reading; /* [sensors] -> doubles, as the sensor's model reads them */
    const double *weight;         /* [sensors] 0: not read or nothing new; up to 1 */
    struct nav_track *track;      /* [sensors] nav_trust_learn notes there what was expected; NULL: not noted */
    const double *moved;   /* [sensors] path since the reading before this one, m; NULL: nothing of it is known */
    const double *unknown; /* [sensors] log-likelihoods where nothing is mapped, as nav_likelihood has them of this
                              row; NULL: they follow from `moved` */
};

/* blur_m: standard deviation of a contact's distance over the poses that one look-up stands for. NULL: no memory. */
struct nav_likelihood *nav_likelihood_new(const struct nav_arena *, const struct nav_robot *,
                                          const struct nav_settings *, double blur_m);
void nav_likelihood_free(struct nav_likelihood *);

/* Fills the tables for one row: weight * log(trust * p / p_broken + 1 - trust), 0 where nothing was read. */
void nav_likelihood_read(struct nav_likelihood *, const struct nav_evidence *);

/* What each sensor should meet at a place: codes[whiskers]. */
void nav_likelihood_expect(const struct nav_likelihood *, const struct nav_place *, uint8_t *codes);

/* Prior of standing at a clear place by that of one on mapped ground: ground.h. */
double nav_likelihood_prior(const struct nav_likelihood *, double x, double y);

/* Whether the robot can stand at (x, y), its body taken `grace` m smaller, and can have come there. */
bool nav_likelihood_clear(const struct nav_likelihood *, double x, double y, double grace);

/* Log-likelihood of the row last read at a place: the sum over sensors (conditionally independent given the pose, as in
 * the paper); and codes[whiskers] that it expects, 0 for kinds that were not read. */
float nav_likelihood_at(const struct nav_likelihood *, const struct nav_place *, uint8_t *codes);

/* Gives the same log-likelihood, but -INFINITY where the robot cannot stand. */
double nav_likelihood_standing(const struct nav_likelihood *, const struct nav_place *);

size_t nav_likelihood_bytes(const struct nav_likelihood *);

#endif
