/* Vibration about the quasi-static shape: modal coordinates, stepped exactly for an input that is linear over a tick.
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

#include "mech_modes.h"

/* cffi: begin */
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
    double ring_input; /* bound on the moment's swing per jump of the input's rate */
    double ring_turn;  /* and per jump of the mount's rate of turn */
    double lag_moment; /* bound on the moment's lag per rate of input */
    double decay;      /* of the slowest mode over a tick */
    double damping;
    double slack; /* 1/(1 - damping): envelope of a swing over |position| + |speed|/omega */
};

struct mech_motion {
    double at[MECH_MODES], speed[MECH_MODES];
    double input; /* at the last tick */
};

void mech_basis_of(const struct mech_whisker *whisker, const struct mech_modes *modes, bool pinned, double s,
                   double tick_s, struct mech_basis *basis);

/* Lets a tick pass while the input goes linearly to a value. */
void mech_basis_step(const struct mech_basis *basis, struct mech_motion *motion, double input);

/* The same for a part of a tick, s. */
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

/* Bound on the moment's swing about the solution that follows an input of this rate, N m; its lag is not in it. */
double mech_basis_swing(const struct mech_basis *basis, const struct mech_motion *motion, double rate);
/* cffi: end */

#endif
