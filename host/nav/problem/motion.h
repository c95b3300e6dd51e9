/* What odometry says and how far it can be trusted. */
#ifndef NAV_MOTION_H
#define NAV_MOTION_H

#include <stdbool.h>

#include "arena.h"
#include "pose.h"
#include "settings.h"

/* Motion since the last row, in the robot's frame then. */
struct nav_motion {
    struct nav_pose step;
    double unknown_m; /* distance and angle that may have gone unreported (rows lost, odometry not readable) */
    double unknown_rad;
    bool carried; /* and it may have been put down anywhere: NAV_CARRIED */
};

/* Variances of one motion. Position noise is taken as equal along and across. */
struct nav_noise {
    double position; /* m^2, per axis */
    double heading;  /* rad^2 */
};

/* Motion put off: motions compose exactly, and an early error in heading leads the later ones astray. */
struct nav_pending {
    struct nav_pose step;
    struct nav_noise noise;
    double swing_x,
        swing_y; /* covariance of heading and end point, m rad, in the frame of the start, a quarter turn back */
};

void nav_pending_add(struct nav_pending *, struct nav_pose step, struct nav_noise);

/* Noise of one row's motion. The robot's relative error keeps its value over a correlation length, so variance grows
 * with distance times that length, not with each row's own square; rows may be short or long. */
struct nav_noise nav_motion_noise(const struct nav_robot *, const struct nav_settings *, const struct nav_motion *);

#endif
