/* A whisker whose shaft or tip meets objects: what its plug does, tick by tick, at the level of detail that is needed.
 *
 * Levels: rest (nothing touches, nothing moves: no work); else a static law, closed form or large deflection, with or
 * without vibration. The level is chosen every tick from what touches, within two bounds:
 *
 * - law: the closed form is used while its relative error is at most `relative`, by mech_table_trust();
 * - vibration: what is left out is a linear damped system driven by jumps of the contact's and the mount's rates, so a
 *   jump d of the input's rate can move the moment by at most ring d, fading with the slowest mode. These are added up;
 *   vibration is switched on before the sum plus the lag at the present rate passes `moment`.
 *
 * So at every tick |moment - moment with everything on| <= 3 relative |largest moment of the contact so far| + 2
 * moment: 3, because vibration passes the law's error on with at most a step's overshoot, twice, and friction may start
 * the large deflection on its other side, once; 2, once for what was left out before vibration began and once for what
 * was dropped when it ended. Both switch back only at a fraction of the bound, so they do not chatter. The bounds hold
 * for a contact at a fixed place of the shaft and without bounces.
 */
#ifndef MECH_SHAFT_H
#define MECH_SHAFT_H

#include <stdbool.h>

#include "mech_table.h"
#include "mech_vibration.h"

/* cffi: begin */
enum { MECH_REST = 0, MECH_CLOSED = 1, MECH_LARGE = 2, MECH_VIBRATION = 4, MECH_AUTO = -1 };

struct mech_tolerance {
    double relative; /* of the closed form's moment */
    double moment;   /* N m, of the vibration left out */
};

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
    struct mech_tolerance tolerance;
    struct mech_modes modes;
    struct mech_basis free, pinned; /* both at the last place of contact */
    struct mech_trust trust;        /* there */
    struct mech_motion motion;      /* pinned or free: at_pin */
    struct mech_hold hold;
    double tick_s, compliance;
    int forced; /* MECH_AUTO or MECH_CLOSED or MECH_LARGE, with MECH_VIBRATION or not */
    int level;  /* of the last tick */
    bool engaged, slipped, at_pin;
    double side;       /* +1 or -1: sign of theta */
    double input;      /* deflection at the contact that stands for the static moment, m */
    double input_rate; /* m/s */
    double base_rate;
    double neglected; /* bound on the moment's swing that is left out, N m */
    double creep;     /* rad */
    double moment;    /* N m, signed: at the base */
    double tilt;      /* rad, signed: of the plug, creep included */
};

/* Default tolerances: 0.5 % and 0.5 uN m, which is 0.005 degrees of tilt: half the sensor's noise. */
struct mech_tolerance mech_tolerance_default(void);

/* A whisker at rest. The table must outlive it. */
void mech_shaft_start(struct mech_shaft *shaft, const struct mech_whisker *whisker, const mech_table *table,
                      double tick_s);

/* Lets a tick pass. Angles beyond 3.2 rad and radii outside the shaft are taken as no touch, rates of turn beyond
 * 1000 rad/s as no change. */
void mech_shaft_step(struct mech_shaft *shaft, const struct mech_touch *touch);
/* cffi: end */

#endif
