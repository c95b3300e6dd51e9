/* Static bending of a tapered whisker, small deflections, closed form (conical-beam model of Birdwell et al. 2007).
 *
 * Beam coordinate s from the follicle's exit; d(s) = D0 (1 - s/Lc), I(s) = I0 (1 - s/Lc)^4. A point force acts at
 * s = a, 0 < a < Lc. Lengths in m, angles in rad, forces in N. The whisker is that of whisker_constants.h.
 */
#ifndef SIM_BEAM_H
#define SIM_BEAM_H

/* Stiffness against a normal force at a, base clamped: k_c = 3 E I0 (1 - a/Lc) / a^3, N/m. */
double sim_beam_stiffness(double a);

/* Base moment when the base is held in a plug of rotational stiffness kappa 3 E I0/Lc and the whisker is pushed by the
 * angle theta at a: M = theta / (1/k + a Lc / (3 E I0 (Lc - a))), N m. */
double sim_beam_moment(double a, double theta, double kappa);

/* The same with the base clamped: M = 3 E I0 theta (1/a - 1/Lc), N m. */
double sim_beam_moment_clamped(double a, double theta);

/* Tilt of the magnet in its plug: phi = theta (1 - x) / (1 - x + kappa x), x = a/Lc, rad. */
double sim_beam_tilt(double a, double theta, double kappa);

/* Rotational stiffness of a plug with this kappa: kappa 3 E I0 / Lc, N m/rad. */
double sim_beam_plug_stiffness(double kappa);

#endif
