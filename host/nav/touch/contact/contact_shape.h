/* What a trace shows of its contact: when the push began, stopped and let go, how far and along which direction it bent
 * the whisker, and how the bending grew. A whisk is rest, a push at a steady rate, perhaps a hold, and the way back; a
 * recording may end with the push.
 */
#ifndef NAV_CONTACT_SHAPE_H
#define NAV_CONTACT_SHAPE_H

#include "contact_trace.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
enum nav_shape_quality {
    NAV_SHAPE_NONE, /* nothing that stands out of the noise: no other member counts */
    NAV_SHAPE_PEAK, /* a peak, but too few samples of the push: `peak` and `direction` count */
    NAV_SHAPE_WHOLE /* everything counts, but for members that say "NAN" */
};

struct nav_shape {
    enum nav_shape_quality quality;
    double onset_s,
        stop_s;       /* push begins, ends; from lines through the push and what follows it, not from thresholds */
    double release_s; /* deflection is back at rest; NAN: not in the trace */
    double peak;      /* deflection at stop_s, in the unit of the channels */
    double raw_peak;  /* largest mean deflection of a bin */
    double turn;      /* commanded angle from onset to stop, rad (seconds where no rate is known) */
    double reported;  /* the same of the rate that the base reports */
    double slope;     /* of the push, per second */
    double bow;       /* change of slope over the push as a share of the slope: creep, large deflection */
    double back;      /* ln of (release - stop)/(stop - onset); NAN without a release */
    double misfit;    /* what a smooth push leaves unexplained, RMS as a share of the peak */
    double noise;     /* RMS of the bins before the push, as a share of the peak */
    double frozen;    /* longest run of equal samples of a channel that bends, as a share of the push */
    double bad;       /* share of the samples that were not finite */
    double direction[NAV_TRACE_AXES]; /* unit vector of the deflection */
};

void nav_shape_of(const struct nav_trace *, struct nav_shape *);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
