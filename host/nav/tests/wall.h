/* A robot that drives to a wall at x = 1 m, sweeps the whisker of rooms.h along it, and drives back: rows for any
 * mapper. */
#ifndef NAV_TEST_WALL_H
#define NAV_TEST_WALL_H

#include <math.h>

#include "replay.h"

struct drive {
    nav_step *step;
    void *mapper;
    struct nav_pose pose; /* true */
    double t_s;
    struct nav_estimate estimate;
};

/* The true distance from the wall. */
static inline double wall_distance(struct nav_pose pose)
{
    double base_x = pose.x + 0.05 * cos(pose.theta), along = (1.0 - base_x) / cos(pose.theta);
    return cos(pose.theta) > 0.1 && along >= 0.0 && along <= 0.2 ? along : (double)INFINITY;
}

/* A step of the robot, whose wheels report `gain` times the distance. */
static inline void drive_step(struct drive *d, double forward, double turn, double gain)
{
    d->pose = nav_compose(d->pose, (struct nav_pose){forward, 0.0, turn});
    d->t_s += 0.1;
    double texture[2] = {NAN, NAN}, radial = wall_distance(d->pose);
    struct nav_row row = {
        .t_s = d->t_s, .odometry = {gain * forward, 0.0, turn}, .texture = texture, .radial_m = &radial};
    d->step(d->mapper, &row, &d->estimate);
}

/* Drives to the wall, sweeps along it, and back. */
static inline void drive_bout(struct drive *d, double gain)
{
    for (int n = 0; n < 30; n++)
        drive_step(d, 0.02, 0.0, gain);
    for (int n = 0; n < 20; n++)
        drive_step(d, 0.0, n < 5 || n >= 15 ? 0.1 : -0.1, gain);
    for (int n = 0; n < 30; n++)
        drive_step(d, -0.02, 0.0, 1.0);
}

#endif
