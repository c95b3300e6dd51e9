/* Parts of the odometry: how a firmware treats remainders. */
#ifndef CREATE_ODOMETRY_PARTS_H
#define CREATE_ODOMETRY_PARTS_H

#include "create/odometry.h"

/* Looks at one frame of Create 1: what it was asked to drive (m) against what it told. */
void remainder_watch(struct create_odometry *odometry, const struct create_frame *frame, double asked_m);

/* What one frame was asked to drive: mean of both wheels, m, and turn, rad. */
double odometry_asked_distance(const struct create_frame *frame);
double odometry_asked_angle(const struct create_odometry *odometry, const struct create_frame *frame);

#endif
