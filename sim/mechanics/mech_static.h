/* Level "closed": static bending of a tapered whisker in its plug, small deflections, closed form.
 *
 * The conical-beam model of Birdwell et al. 2007 (J Neurophysiol 98:2439): a fixed point at radial distance a from the
 * follicle's exit pushes the whisker by the angle theta. 0 < a < cone.
 */
#ifndef MECH_STATIC_H
#define MECH_STATIC_H

#include "mech_whisker.h"

/* cffi: begin */
/* Base moment, N m: theta / (1/k + a cone/(3 E I0 (cone - a))). */
double mech_static_moment(const struct mech_whisker *whisker, double a, double theta);

/* Tilt of the plug: theta (1 - x)/(1 - x + kappa x), x = a/cone; not held at the stop. 0 for a clamped whisker. */
double mech_static_tilt(const struct mech_whisker *whisker, double a, double theta);

/* Stiffness against a normal force at a, base clamped, N/m: 3 E I0 (1 - a/cone)/a^3. */
double mech_static_stiffness(const struct mech_whisker *whisker, double a);
/* cffi: end */

#endif
