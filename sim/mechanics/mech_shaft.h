/* A whisker whose shaft or tip meets objects: what its plug does, tick by tick, at a level of detail.
 *
 * The level is the caller's: a static law, closed form or large deflection with friction and slip-off, with or without
 * vibration. A whisker that nothing touches and whose swing has faded rests: its ticks cost nothing.
 */
#ifndef MECH_SHAFT_H
#define MECH_SHAFT_H

#include <stdbool.h>

#include "mech_elastica.h"
#include "mech_vibration.h"

/* cffi: begin */
/* What the world does to the whisker in a tick. */
struct mech_touch {
    bool touching;
    double radius;    /* distance of the touched point from the follicle's exit, m */
    double theta;     /* imposed angle of that point about the unbent whisker, rad, signed; a contact begins with the
                         first that is not 0 and keeps its side */
    double base_rate; /* mount's rate of turn in the plane of bending, rad/s */
    bool face;        /* the tip on a face, which it cannot slip past: always the closed form, whatever its error */
};

struct mech_shaft {
    struct mech_whisker whisker;
    const mech_table *table;
    struct mech_modes modes;
    struct mech_basis free, pinned; /* both at the last place of contact */
    struct mech_motion motion;      /* pinned or free: at_pin */
    struct mech_hold hold;
    double tick_s, compliance;
    int level;
    bool engaged, slipped, at_pin;
    bool resting; /* nothing to do in a tick without a touch */
    double side;  /* +1 or -1: sign of theta */
    double input; /* deflection at the contact that stands for the static moment, m */
    double base_rate;
    double creep;  /* rad */
    double moment; /* N m, signed: at the base */
    double tilt;   /* rad, signed: of the plug, creep included */
};

/* A whisker at rest. The table must outlive it. */
void mech_shaft_start(struct mech_shaft *shaft, const struct mech_whisker *whisker, const mech_table *table, int level,
                      double tick_s);

/* Lets a tick pass. Angles beyond 3.2 rad and radii outside the shaft are taken as no touch, rates of turn beyond
 * 1000 rad/s as no change. */
void mech_shaft_step(struct mech_shaft *shaft, const struct mech_touch *touch);
/* cffi: end */

#endif
