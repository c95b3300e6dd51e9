/* Radial distance from a whole whisk, with its uncertainty: how far the whisker bent for how far it was pushed.
 *
 * A whisker pushed by an angle theta at distance a tilts its plug by theta h(a), h = (1 - x)/(1 - x + kappa x), x =
 * a/cone (conical beam in a compliant plug, Birdwell et al. 2007; kappa 1 is equation 3's line, kappa large the clamped
 * beam). So
 *     ln peak = log_gain + ln h(a) + sum of weight[k] (term[k] - mean[k]) + error of the whisk,
 * where the terms are what the samples, the commanded rate and the base's reports say of the whisk. Weights come from
 * calibration with priors from physics: 1 for the logarithm of the angle pushed. What
 * comes out is the mean of the posterior over the radii that are possible, and an alternative hypothesis "this whisk is
 * none of those calibrated" takes part, so that what does not fit is doubted rather than believed.
 */
#ifndef NAV_RADIAL_WHISK_H
#define NAV_RADIAL_WHISK_H

#include "contact_shape.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
enum nav_whisk_term {
    NAV_WHISK_TURN,     /* ln of the commanded angle of the push, rad; of its seconds where no rate is known */
    NAV_WHISK_RATE,     /* ln of the commanded rate, rad/s; 0 where it is not known */
    NAV_WHISK_REPORTED, /* ln of reported over commanded angle; 0 where nothing is reported */
    NAV_WHISK_BOW,      /* see struct nav_shape */
    NAV_WHISK_BACK,
    NAV_WHISK_TERMS
};

struct nav_whisk_model {
    int axes;
    double log_gain, kappa, cone_mm;
    double weight[NAV_WHISK_TERMS], mean[NAV_WHISK_TERMS];
    double scatter[NAV_WHISK_TERMS]; /* standard deviation of each term in calibration: of one that is missing */
    double covariance[NAV_WHISK_TERMS][NAV_WHISK_TERMS]; /* of the weights */
    double spread;                    /* standard deviation of ln peak from whisk to whisk, constant's included */
    double low_mm, high_mm;           /* radii that are possible */
    double tip_mm;                    /* from here on it is the tip */
    double direction[NAV_TRACE_AXES]; /* unit vector in which it bent in calibration, 0 to 0: not looked at */
    double direction_sd;              /* rad */
    double log_misfit, log_misfit_sd; /* of ln misfit in calibration */
    double frozen;                    /* largest in calibration */
};

struct nav_whisk_estimate {
    double radius_mm;  /* posterior mean */
    double sigma_mm;   /* posterior standard deviation */
    double tip;        /* probability that it is the tip */
    double confidence; /* probability that the whisk is one of those calibrated */
};

/* ln h(a); -INFINITY from the cone's point on. */
double nav_whisk_height(double kappa, double cone_mm, double radius_mm);

/* Terms of a whisk [NAV_WHISK_TERMS]; NAN: not measured. */
void nav_whisk_terms(const struct nav_shape *, double *terms);

/* Estimates; never NAN. A whisk without contact has the prior's mean and deviation, and no confidence. */
void nav_whisk_estimate(const struct nav_whisk_model *, const struct nav_shape *, struct nav_whisk_estimate *);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
