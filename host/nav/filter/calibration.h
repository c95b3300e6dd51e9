/* A constant error of the odometry, learned while a filter is sure of itself: how much longer and further round the
 * robot goes than its wheels say.
 *
 * Causal, slow and bounded: the wheels' account of a stretch is compared with the filter's, from one sure pose to the
 * next sure one at least NAV_STRETCH_M or NAV_STRETCH_RAD later; the two ratios are followed by scalar Kalman filters
 * whose noise is what the filter says of its own spread at both ends. */
#ifndef NAV_CALIBRATION_H
#define NAV_CALIBRATION_H

#include <stdbool.h>

#include "motion.h"
#include "problem.h"

#define NAV_STRETCH_M 0.3
#define NAV_STRETCH_RAD 0.8

struct nav_ratio {
    double value, variance;
};

struct nav_calibration {
    struct nav_ratio distance, turn; /* true by reported, 0.7 .. 1.3 */
    bool sure;                       /* a stretch is under way */
    struct nav_pose from;            /* its first pose ... */
    double from_covariance[9];
    struct nav_pose reported; /* ... and what the wheels, so far corrected, have said since */
};

void nav_calibration_init(struct nav_calibration *);

/* The motion with what has been learned put right. */
struct nav_motion nav_calibration_apply(const struct nav_calibration *, const struct nav_motion *);

/* After each row: the motion as applied and what the filter now says. */
void nav_calibration_learn(struct nav_calibration *, const struct nav_motion *applied, const struct nav_estimate *);

#endif
