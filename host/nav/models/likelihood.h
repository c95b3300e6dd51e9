/* All whiskers of a robot: expected codes at a pose, and the likelihood of a row of readings given codes. */
#ifndef NAV_LIKELIHOOD_H
#define NAV_LIKELIHOOD_H

#include <stdint.h>

#include "arena.h"
#include "measurement.h"
#include "trust.h"

/* One row's readings, texture whiskers first, then object whiskers. */
struct nav_evidence {
    const double *const *reading; /* [whiskers] -> doubles, as the whisker's model reads them */
    const double *weight;         /* [whiskers] 0: not read or nothing new; up to 1 */
};

struct nav_likelihood {
    int whiskers;
    int tips;
    struct nav_model *model; /* [whiskers] */
    float **table;           /* [whiskers][codes] log-likelihoods of the present row, weight and trust applied */
    double **ratio;          /* [whiskers][codes] what the models gave, see measurement.h */
    double *weight;          /* [whiskers] of the present row */
    struct nav_trust *trust; /* [whiskers], see trust.h */
};

/* blur_m: standard deviation of a contact's distance over the poses that one look-up stands for. NULL: no memory. */
struct nav_likelihood *nav_likelihood_new(const struct nav_arena *, const struct nav_robot *,
                                          const struct nav_settings *, double blur_m);
void nav_likelihood_free(struct nav_likelihood *);

/* Fills the tables for one row: weight * log(trust * p / p_broken + 1 - trust), 0 where nothing was read. */
void nav_likelihood_read(struct nav_likelihood *, const struct nav_evidence *);

/* What each whisker should meet at this pose: codes[whiskers]. */
void nav_likelihood_expect(const struct nav_likelihood *, const struct nav_arena *, const struct nav_robot *,
                           struct nav_pose, uint8_t *codes);

/* Code of a distance along an object whisker; INFINITY: nothing within reach. */
uint8_t nav_likelihood_range_code(const struct nav_model *, double range);

/* Log-likelihood of the row last read: sum over whiskers (conditionally independent given the pose, as in the paper).
 */
float nav_likelihood_of(const struct nav_likelihood *, const uint8_t *codes);

#endif
