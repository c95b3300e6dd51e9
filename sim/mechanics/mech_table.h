/* Level "large": the elastica's solutions in a table, with a plug at the base, friction at the contact and slip-off.
 *
 * The table is in the beam's own units (mech_elastica.h) and so serves every whisker. It is laid out over distance and
 * slope at the contact, because a branch of equilibria runs smoothly through its largest moment and its fold in the
 * slope, and quadratically over the friction ratio nu.
 */
#ifndef MECH_TABLE_H
#define MECH_TABLE_H

#include <stdbool.h>

#include "mech_whisker.h"

/* cffi: begin */
typedef struct mech_table mech_table;

enum { MECH_ROWS = 4, MECH_VALUES = 9 };

/* What a whisker bent at a peg remembers between moments: its state, and the table's rows at its distance. */
struct mech_hold {
    double slope; /* at the contact, rad; 0: not bent */
    double nu;    /* friction along the beam over normal force */
    double arc;   /* of the contact, in cones */
    double x;     /* what the rows are for: distance in cones ... */
    int first;    /* ... and slopes from this one on */
    double row[MECH_ROWS][MECH_VALUES];
};

/* Works the table out (about 0.2 s). NULL if memory is short. */
mech_table *mech_table_new(void);
void mech_table_free(mech_table *table);

/* Base moment (N m) of a whisker at a peg at distance a (m) and angle theta >= 0 (rad) about the unbent whisker. The
 * contact sticks to the peg until friction is used up, then slides. The hold goes on from the last moment's; start a
 * contact with a zeroed one. false: the peg is beyond the fold or slides past the tip, the whisker has slipped off; the
 * moment is then the last before. Distances are held to 0.1..0.86 cones. */
bool mech_table_moment(const mech_table *table, const struct mech_whisker *whisker, double a, double theta,
                       struct mech_hold *hold, double *moment);

/* How far the closed form can be trusted at a distance, for a whisker of this friction. While the whisker itself bends
 * by an angle b (of the line to the peg, the plug's tilt taken off), the closed form's moment is off by at most the
 * share curvature b^2 + friction b, as long as that is below 5 %: both are the table's worst cases. limit: the angle b
 * at which a frictionless whisker lets go or its moment has its peak, whichever comes first. */
struct mech_trust {
    double curvature, friction, limit; /* 1/rad^2, 1/rad, rad */
};

struct mech_trust mech_table_trust(const mech_table *table, const struct mech_whisker *whisker, double a);
/* cffi: end */

#endif
