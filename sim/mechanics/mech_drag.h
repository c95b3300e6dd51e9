/* A whisker whose tip is dragged over a floor, in two planes: along the path (axis 0: friction, stick and slip, catches
 * at borders) and across it (axis 1: the floor's height and the preload).
 *
 * With vibration: the tip sticks while friction holds it (the tip is pinned to the floor), slips under kinetic friction
 * until it moves with the floor again, and lifts off where the floor falls away faster than it follows. Normal force is
 * preload plus what the height makes of it, vibration included. Without: the height one to one and a sawtooth whose
 * jump is J = 2 (mu_s - mu_k) N/k_tip. A whisker that stands still and whose swing has faded rests: its ticks cost
 * nothing. Small deflections; a hook uses the closed form at the angle from the mount, held at the plug's stop.
 *
 * A step up of the floor holds the tip at its corner until the shaft has slid up it (mech_edge.h). A step of a floor
 * with a pile holds the tip like a hook until the whisker is pulled straight: by a mount at height h, until the tip
 * lies sqrt(length^2 - h^2) behind the mount. Off a step down the tip falls. Steps against which the tip is pushed
 * backwards are ridden over.
 */
#ifndef MECH_DRAG_H
#define MECH_DRAG_H

#include <stdbool.h>

#include "mech_edge.h"
#include "mech_floor.h"

/* cffi: begin */
/* States of the tip: held by the floor, sliding over it or in the air, hooked by a pile, held at the corner of a step.
 */
enum { MECH_STICKS, MECH_SLIPS, MECH_HOOKED, MECH_EDGE };

/* How a whisker is mounted over the floor. Lengths in m. */
struct mech_stance {
    double preload; /* deflection that presses the tip on the floor */
    double height;  /* of the mount over the floor */
    double behind;  /* of the tip at rest, behind the mount along the path; negative: ahead; the rest of the length goes
                       aside */
};
/* cffi: end */

/* What happens in a tick. */
struct mech_stroke {
    double travel;    /* of the mount along the path, m, signed */
    double height;    /* of the floor under the tip over the first floor, m: it changes at borders */
    double base_rate; /* rate of turn of the mount in the plane of the path, rad/s */
};

/* A tip that a pile holds. Lengths in m. */
struct mech_hook {
    double behind, caught_at; /* of the tip behind the mount: now, and when it was caught */
    double offset;            /* deflection when it was caught over what the angle accounts for */
};

struct mech_drag {
    struct mech_whisker whisker;
    struct mech_stance stance;
    struct mech_lie lie;
    struct mech_axes axes;
    struct mech_floor profile;
    double compliance;
    bool resting;
    int contact;
    bool lifted;
    double ground; /* deflection across the path that the floor asked for at the last tick, m */
    double anchor; /* deflection of the tip along the path when it sticks, m */
    double base_rate;
    struct mech_edge edge;
    struct mech_hook hook;
    double slip_side;          /* +1 or -1: the tip slips this way along the path */
    double height;             /* of the floor that the tip is on, m */
    long slips, catches;       /* how many so far */
    double moment[2], tilt[2]; /* about the static preload; along the path, across it */
};

/* The mount of the outer whiskers: 5 mm preload, 80 mm high, tip half its reach behind. */
struct mech_stance mech_stance_default(void);

/* Horizontal reach of a straight whisker, m; 0 if it does not reach the floor. */
double mech_drag_reach(const struct mech_whisker *whisker, const struct mech_stance *stance);

/* A whisker standing on a floor. Of the level only MECH_VIBRATION counts: a dragged tip has no large deflection. */
void mech_drag_start(struct mech_drag *drag, const struct mech_whisker *whisker, const struct mech_stance *stance,
                     const struct sim_floor_texture *floor, struct sim_rng rng, int level, double tick_s);

/* Lets a tick pass over this floor. Heights and travels beyond 100 m and rates of turn beyond 1000 rad/s are taken as
 * no tick. */
void mech_drag_step(struct mech_drag *drag, const struct sim_floor_texture *floor, const struct mech_stroke *stroke);

#endif
