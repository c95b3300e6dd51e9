/* Free bending modes of a tapered whisker in its plug, and its static compliance.
 *
 * Modes solve the integral equation W(s) = omega^2 integral G(s, t) m(t) W(t) dt, with G the deflection at s of a unit
 * force at t (closed form for a cone) and m the mass per length: Nystroem's method on Gauss-Legendre nodes. Static
 * compliance that the kept modes leave out is known exactly and kept as a residual, so that statics are exact whatever
 * the number of modes.
 */
#ifndef MECH_MODES_H
#define MECH_MODES_H

#include "mech_whisker.h"

/* cffi: begin */
enum { MECH_MODES = 5, MECH_NODES = 24 };

struct mech_modes {
    double omega[MECH_MODES];  /* rad/s, undamped */
    double moment[MECH_MODES]; /* base moment per modal coordinate, N m / (m sqrt(kg)) */
    double turn[MECH_MODES];   /* modal force per angular acceleration of the whisker's mount */
    double node[MECH_NODES], mass[MECH_NODES];
    double shape[MECH_MODES][MECH_NODES]; /* modal mass 1 kg */
    double mass_total;                    /* kg */
};

/* Works the modes out (about 2 ms). */
void mech_modes_of(const struct mech_whisker *whisker, struct mech_modes *modes);

/* Deflection of each mode at s, 0 < s <= length. */
void mech_modes_at(const struct mech_whisker *whisker, const struct mech_modes *modes, double s,
                   double shape[MECH_MODES]);

/* Deflection at s of a unit normal force at t, the plug's tilt included, m/N. */
double mech_modes_compliance(const struct mech_whisker *whisker, double s, double t);
/* cffi: end */

#endif
