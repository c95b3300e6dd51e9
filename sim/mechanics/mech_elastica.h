/* Large deflection of a clamped tapered beam pushed by a fixed peg, exactly: the elastica.
 *
 * Everything is in units of the beam: lengths in cones, moments in E I0/cone, forces in E I0/cone^2, so that one
 * solution serves every whisker. E I(s) dtheta/ds = M(s); the peg pushes normal to the beam, plus nu times as much
 * along it towards the tip (nu > 0: friction while the peg slides towards the tip; |nu| up to the coefficient of
 * friction). Integrated from the contact to the base it is an initial-value problem, which needs no shooting.
 */
#ifndef MECH_ELASTICA_H
#define MECH_ELASTICA_H

#include <stdbool.h>

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
/* cffi: end */

#endif
