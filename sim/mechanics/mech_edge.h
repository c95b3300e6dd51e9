/* The tip of a whisker at an edge of the floor: the shaft lies on the edge's corner until the tip has risen over it.
 *
 * A whisker hangs from its mount to a tip that trails behind and aside of it. Its deflection has two components: level
 * (axis 0) and in the vertical plane through the whisker (axis 1). The corner runs across the path. It pushes along the
 * normal of the plane that holds the corner and the shaft's tangent at the tip, which turns as the whisker bends: the
 * more the mount pulls, the flatter the shaft lies and the more of the push lifts the tip. Friction acts against the
 * slip of shaft along corner; as the shaft slides along itself anyway, its share across the shaft grows with the slip
 * that way (Coulomb's law in the plane of contact).
 *
 * First floor and corner hold the tip, until the corner has taken over what pressed the tip on the floor. Then the
 * shaft slides up the corner, until the tip is as high as the corner or the shaft jumps off.
 */
#ifndef MECH_EDGE_H
#define MECH_EDGE_H

#include <stdbool.h>

#include "mech_vibration.h"

/* How the unbent whisker lies: unit vectors (path, left of it, up) along the shaft and along the two axes. */
struct mech_lie {
    double shaft[3], axis[2][3];
    double length; /* of the whisker, m */
    double turn;   /* of the tangent at the tip per deflection there, rad/m */
    double lift;   /* deflection across the path per height of the tip */
    double radius; /* of the tip, m */
};

enum { MECH_EDGE_LEFT, MECH_EDGE_TOUCHED, MECH_EDGE_PASSED };

/* The corner that the tip is about to pass. Deflections of both axes in m. */
struct mech_edge {
    double rise;          /* deflection of axis 1 at which the shaft is off the corner */
    double ground;        /* ... and that which the floor before it asks for */
    double touched[2];    /* deflection at which the corner was touched last */
    double travel;        /* of the mount since then, m */
    bool ahead, on_floor; /* there is one; the tip touches the floor too */
};

/* A whisker's two axes, in the bases of a tip that is free and of one that is pinned. An edge moves both axes as free
 * whiskers with the force at the tip as input. */
struct mech_axes {
    struct mech_basis free, pinned;
    struct mech_motion motion[2];
    bool vibrate; /* false: each tick at rest */
};

/* The lie of a whisker whose mount is `height` above the floor and whose tip is `behind` it along the path. */
struct mech_lie mech_lie_of(const struct mech_whisker *whisker, double height, double behind);

/* By how much the tip's deflection across the path grows until the shaft is off the corner of a step of this height:
 * the round of the tip rolls over the rest. Not above 0: the tip rolls over all of it. */
double mech_edge_rise(const struct mech_lie *lie, double height);

/* The shaft touches the corner, where the whisker is now. */
void mech_edge_touch(struct mech_edge *edge, const struct mech_axes *axes, bool on_floor);

/* A tick at the corner, in which the mount travels on. Says whether the tip touches it still. */
int mech_edge_step(struct mech_edge *edge, const struct mech_lie *lie, struct mech_axes *axes, double friction,
                   double travel);

/* A tick off the corner that it has left: is it back? Deflections as they are now. */
int mech_edge_watch(struct mech_edge *edge, const struct mech_lie *lie, const double at[2], double travel);

#endif
