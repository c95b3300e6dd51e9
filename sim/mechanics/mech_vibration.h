/* Free bending modes of a tapered whisker in its plug, and vibration about the quasi-static shape: modal coordinates,
 * stepped exactly for an input that is linear over a tick.
 *
 * Modes solve the integral equation W(s) = omega^2 integral G(s, t) m(t) W(t) dt, with G the deflection at s of a unit
 * force at t (closed form for a cone) and m the mass per length: Nystroem's method on Gauss-Legendre nodes. Static
 * compliance that the kept modes leave out is known exactly and kept as a residual, so that statics are exact whatever
 * the number of modes.
 *
 * A whisker is free, with a force at a point s as input, or pinned at s, with the deflection there as input. Pinning
 * couples the free modes through the residual compliance r of what they leave out, K = diag(omega^2) + z z'/r, and
 * turns them into others: coordinates change by a rotation, nothing is lost. With a constant input either comes to rest
 * at the static solution exactly. This is the model of Boubenec, Shulz and Debregeas 2012 (quasi-static shape plus
 * resonant modes).
 */
#ifndef MECH_VIBRATION_H
#define MECH_VIBRATION_H

#include <stdbool.h>

#include "mech_whisker.h"

#define MECH_FADED 0.125e-6 /* N m: a swing below it, 0.0013 degrees of tilt, is dropped when nothing drives it */

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

/* Modes under one condition at s. Input u and answer: force (N) and deflection at s (m) if free, the reverse if pinned.
 */
struct mech_basis {
    bool pinned;
    double s;
    double omega[MECH_MODES];
    double mode[MECH_MODES][MECH_MODES]; /* each as a sum of free modes */
    double settle[MECH_MODES];           /* static coordinate per input */
    double lag[MECH_MODES];              /* coordinate behind the static one, per rate of input */
    double moment[MECH_MODES], moment_input;
    double answer[MECH_MODES], answer_input;
    double turn[MECH_MODES];    /* coordinate's speed per jump of the mount's rate of turn */
    double step[4][MECH_MODES]; /* position and speed after a tick from position and speed */
    double tick_s;
    double moment_static; /* base moment per input, at rest */
    double answer_static;
    double damping;
};

struct mech_motion {
    double at[MECH_MODES], speed[MECH_MODES];
    double input; /* at the last tick */
};

void mech_basis_of(const struct mech_whisker *whisker, const struct mech_modes *modes, bool pinned, double s,
                   double tick_s, struct mech_basis *basis);

/* Moves a free and a pinned basis of a whisker to another place, which costs less than working them out anew. */
void mech_basis_move(const struct mech_whisker *whisker, const struct mech_modes *modes, double s,
                     struct mech_basis *free, struct mech_basis *pinned);

/* Lets a tick pass while the input goes linearly to a value. */
void mech_basis_step(const struct mech_basis *basis, struct mech_motion *motion, double input);

/* Does the same for a part of a tick, s. */
void mech_basis_step_part(const struct mech_basis *basis, struct mech_motion *motion, double input, double time_s);

/* Carries a motion over to another condition, whose input is now this. */
void mech_basis_change(const struct mech_basis *from, const struct mech_basis *to, struct mech_motion *motion,
                       double input);

/* A free tip or shaft that meets what it is pinned to later, within a tick. `before` is its motion at the tick's start,
 * the pin went from `from` to `to`. Were it pinned only at the tick's end, what it went too far would be energy from
 * nowhere, and it would bounce higher every time. The motion at the tick's end is put in place of `before`. */
void mech_basis_land(const struct mech_basis *free, const struct mech_basis *pinned, struct mech_motion *before,
                     double from, double to);

/* At rest relative to an input that changes at a rate. */
void mech_basis_settle(const struct mech_basis *basis, double input, double rate, struct mech_motion *motion);

/* The mount's rate of turn jumps (rad/s). */
void mech_basis_turn(const struct mech_basis *basis, struct mech_motion *motion, double jump);

double mech_basis_moment(const struct mech_basis *basis, const struct mech_motion *motion); /* N m */
double mech_basis_answer(const struct mech_basis *basis, const struct mech_motion *motion); /* N or m */

/* Bound on the moment's swing about where a constant input holds it, N m. */
double mech_basis_swing(const struct mech_basis *basis, const struct mech_motion *motion);
/* cffi: end */

#endif
