/*
 * A planar motion summed up from small steps, with its 3x3 covariance.
 *
 * Errors of three kinds are kept apart, because they add up differently along an arc: scale errors (of wheel diameter,
 * base, slip) are the same in every step and add up linearly; what is estimated for lost time is independent from step
 * to step and adds up as variance; what a counter that reports whole units still lacks is at most a unit at the
 * beginning and at the end, however many steps lie between.
 */
#ifndef CREATE_MOTION_H
#define CREATE_MOTION_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
#define CREATE_SCALES 3 /* scale errors: of distance, of angle, and heading drift per distance */

/* One step: an arc of constant curvature. Lengths in m, angles in rad, anticlockwise positive. */
struct create_step {
    double distance, angle;
    double scale_distance, scale_angle,
        scale_drift;                    /* standard deviations that are the same in every step: m, rad, rad */
    double loose_distance, loose_angle; /* independent ones: m, rad */
    double grain_distance, grain_angle; /* units of the counters: m, rad */
};

/* All zero: no motion. */
struct create_motion {
    double x, y, theta;             /* in the robot's frame at the beginning; theta is not wrapped */
    double scale[3][CREATE_SCALES]; /* derivative of the pose by each scale error, times its standard deviation */
    double loose[3][3];             /* covariance of the independent errors */
    double grain_distance, grain_angle;
};

/* Adds a step at the end of a motion. */
void create_motion_add(struct create_motion *motion, const struct create_step *step);

/* Covariance of (x, y, theta) to first order: m^2, m rad, rad^2; symmetric, positive semidefinite. */
void create_motion_covariance(const struct create_motion *motion, double covariance[3][3]);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
