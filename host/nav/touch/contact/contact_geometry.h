/* One hypothesis of contact_filter.h as geometry: where its contact is, and where the next block's motion takes it.
 * Lengths in cones. */
#ifndef NAV_CONTACT_GEOMETRY_H
#define NAV_CONTACT_GEOMETRY_H

#include "contact_state.h"

/* A hypothesis' state. FIRST: arc length of a contact on the shaft, direction of the force on the tip about the clamped
 * axis. ROUND: curvature of the surface; a corner has none.
 * MOTION: error of the reported motion of the base, as a share of it. */
enum { FIRST, SLOPE, ROUND, SPEED_X, SPEED_Y, GAIN, FRICTION, MOTION };

/* Place, normal's direction and elastic tilt, and their derivatives by the states COLUMN. */
static const int COLUMN[3] = {FIRST, SLOPE, FRICTION};

struct nav_contact_look {
    double q[2], normal, tilt;
    double q_by[3][2], normal_by[3], tilt_by[3];
};

/* false: outside the tables. */
bool nav_contact_look(const struct nav_contact_filter *, const struct nav_contact_part *, struct nav_contact_look *);

/* Moves the state by a block and writes the derivative of the new state by the old. false: no such contact is left. */
bool nav_contact_move(const struct nav_contact_filter *, const struct nav_contact_step *, struct nav_contact_part *,
                      nav_contact_square by);

#endif
