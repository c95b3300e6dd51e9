/* Level "large": large deflection of a tapered beam pushed by a fixed peg, exactly (the elastica); and the same from a
 * table, with a plug at the base, friction at the contact and slip-off.
 *
 * Everything is in units of the beam: lengths in cones, moments in E I0/cone, forces in E I0/cone^2, so that one
 * solution serves every whisker. E I(s) dtheta/ds = M(s); the peg pushes normal to the beam, plus nu times as much
 * along it towards the tip (nu > 0: friction while the peg slides towards the tip; |nu| up to the coefficient of
 * friction). Integrated from the contact to the base it is an initial-value problem, which needs no shooting.
 */
#ifndef MECH_ELASTICA_H
#define MECH_ELASTICA_H

#include <stdbool.h>

#include "mech_whisker.h"

/* cffi: begin */
struct mech_bend {
    double x;      /* distance from base to peg */
    double theta;  /* angle at the base between the beam's root and the line to the peg, rad */
    double slope;  /* angle between the root and the beam at the contact, rad; it grows all along the branch */
    double moment; /* at the base */
    double force;  /* normal to the beam at the contact */
    double arc;    /* from the base to the contact along the beam, below 1 */
};

/* The bend of a force at an arc length, in steps of Runge-Kutta's fourth order. */
struct mech_bend mech_elastica_bend(double arc, double force, double nu, int steps);

/* The bend at a distance and slope: Newton's method from a near one (from->arc, from->force; 0 arc: none). Relative
 * error below 1e-9 of the integrated bend. false if there is none. */
bool mech_elastica_at_slope(double x, double slope, double nu, int steps, const struct mech_bend *from,
                            struct mech_bend *bend);

/* The bend of a peg at a distance that stands at angle theta: the first met when theta grows from 0. false if theta
 * lies beyond the fold: the beam has let go. */
bool mech_elastica_at_angle(double x, double theta, double nu, int steps, struct mech_bend *bend);

/* The elastica's solutions in a table over distance and slope at the contact, because a branch of equilibria runs
 * smoothly through its largest moment and its fold in the slope, and quadratically over the friction ratio nu. */
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
/* cffi: end */

#endif
