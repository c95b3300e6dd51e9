#include "mech_vibration.h"

#include <math.h>
#include <string.h>

#include "whisker_constants.h"

enum {
    BLOCK = MECH_MODES + 3, /* a few vectors more than wanted make the wanted ones converge */
    ROUNDS = 60,
    SWEEPS = 12 /* Jacobi's method on so small a matrix converges in half as many */
};

/* Nodes and weights of Gauss-Legendre quadrature on 0..1: Newton's method on Legendre's polynomial. */
static void mech_vibration_gauss_legendre(double node[MECH_NODES], double weight[MECH_NODES])
{
    for (int i = 0; i < MECH_NODES; i++) {
        double z = cos(SIM_PI * (i + 0.75) / (MECH_NODES + 0.5)), slope = 1;
        for (int round = 0; round < 20; round++) {
            double p = 1, before = 0;
            for (int n = 1; n <= MECH_NODES; n++) {
                double next = ((2 * n - 1) * z * p - (n - 1) * before) / n;
                before = p;
                p = next;
            }
            slope = MECH_NODES * (z * p - before) / (z * z - 1);
            z -= p / slope;
        }
        node[i] = (1 - z) / 2;
        weight[i] = 1 / ((1 - z * z) * slope * slope);
    }
}

/* Integral of (v - a)(v - b)/v^4 from a to 1: bending of a cone by a force, v = 1 - s/cone. */
static double mech_vibration_cone_integral(double a, double b)
{
    return (-1 + (a + b) / 2 - a * b / 3) - (-1 / a + (a + b) / (2 * a * a) - b / (3 * a * a));
}

double mech_modes_compliance(const struct mech_whisker *whisker, double s, double t)
{
    double near = fmin(s, t) / whisker->cone, far = fmax(s, t) / whisker->cone;
    double unit = whisker->cone * whisker->cone * whisker->cone / mech_whisker_bending(whisker);
    return unit * mech_vibration_cone_integral(1 - near, 1 - far) + s * t * mech_whisker_compliance(whisker);
}

typedef double matrix[MECH_NODES][MECH_NODES];

/* Symmetric form of the integral equation: its eigenvalues are 1/omega^2. */
static void mech_vibration_symmetric_form(const struct mech_whisker *whisker, const struct mech_modes *modes,
                                          matrix form)
{
    for (int i = 0; i < MECH_NODES; i++)
        for (int j = 0; j < MECH_NODES; j++)
            form[i][j] =
                sqrt(modes->mass[i] * modes->mass[j]) * mech_modes_compliance(whisker, modes->node[i], modes->node[j]);
}

static double mech_vibration_node_dot(const double *a, const double *b)
{
    double sum = 0;
    for (int i = 0; i < MECH_NODES; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Gram and Schmidt; the squared length before is the last round's stretch. */
static void mech_vibration_orthonormalise(double block[BLOCK][MECH_NODES], double stretch[BLOCK])
{
    for (int k = 0; k < BLOCK; k++) {
        for (int j = 0; j < k; j++) {
            double share = mech_vibration_node_dot(block[k], block[j]);
            for (int i = 0; i < MECH_NODES; i++)
                block[k][i] -= share * block[j][i];
        }
        stretch[k] = sqrt(mech_vibration_node_dot(block[k], block[k]));
        for (int i = 0; i < MECH_NODES; i++)
            block[k][i] /= stretch[k];
    }
}

static void mech_vibration_lay_mass(const struct mech_whisker *whisker, struct mech_modes *modes)
{
    double weight[MECH_NODES];
    mech_vibration_gauss_legendre(modes->node, weight);
    modes->mass_total = 0;
    for (int i = 0; i < MECH_NODES; i++) {
        modes->node[i] *= whisker->length;
        double d = whisker->exit_diameter * (1 - modes->node[i] / whisker->cone);
        modes->mass[i] = whisker->density * SIM_PI / 4 * d * d * weight[i] * whisker->length;
        modes->mass_total += modes->mass[i];
    }
}

void mech_modes_of(const struct mech_whisker *whisker, struct mech_modes *modes)
{
    matrix form;
    double block[BLOCK][MECH_NODES], next[BLOCK][MECH_NODES], stretch[BLOCK];
    mech_vibration_lay_mass(whisker, modes);
    mech_vibration_symmetric_form(whisker, modes, form);
    for (int k = 0; k < BLOCK; k++)
        for (int i = 0; i < MECH_NODES; i++)
            block[k][i] = cos(SIM_PI * k * (i + 0.5) / MECH_NODES);
    for (int round = 0; round < ROUNDS; round++) {
        for (int k = 0; k < BLOCK; k++)
            for (int i = 0; i < MECH_NODES; i++)
                next[k][i] = mech_vibration_node_dot(form[i], block[k]);
        memcpy(block, next, sizeof block);
        mech_vibration_orthonormalise(block, stretch);
    }
    for (int k = 0; k < MECH_MODES; k++) {
        double first = 0;
        modes->omega[k] = 1 / sqrt(stretch[k]);
        for (int i = 0; i < MECH_NODES; i++) {
            modes->shape[k][i] = block[k][i] / sqrt(modes->mass[i]);
            first += modes->node[i] * modes->mass[i] * modes->shape[k][i];
        }
        modes->turn[k] = first;
        modes->moment[k] = modes->omega[k] * modes->omega[k] * first;
    }
}

void mech_modes_at(const struct mech_whisker *whisker, const struct mech_modes *modes, double s,
                   double shape[MECH_MODES])
{
    double bend[MECH_NODES];
    for (int i = 0; i < MECH_NODES; i++)
        bend[i] = mech_modes_compliance(whisker, s, modes->node[i]) * modes->mass[i];
    for (int k = 0; k < MECH_MODES; k++)
        shape[k] = modes->omega[k] * modes->omega[k] * mech_vibration_node_dot(bend, modes->shape[k]);
}

typedef double square[MECH_MODES][MECH_MODES];

static double mech_vibration_dot(const double a[MECH_MODES], const double b[MECH_MODES])
{
    double sum = 0;
    for (int k = 0; k < MECH_MODES; k++)
        sum += a[k] * b[k];
    return sum;
}

/* Turns rows and columns p and q of a symmetric matrix so that their common element vanishes. false: it did. */
static bool mech_vibration_rotate(square a, square vectors, int p, int q)
{
    if (a[p][q] * a[p][q] <= 1e-30 * fabs(a[p][p] * a[q][q]))
        return false;
    double ratio = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    double t = copysign(1, ratio) / (fabs(ratio) + sqrt(1 + ratio * ratio));
    double c = 1 / sqrt(1 + t * t), s = t * c;
    for (int k = 0; k < MECH_MODES; k++) {
        double x = a[k][p], y = a[k][q];
        a[k][p] = c * x - s * y;
        a[k][q] = s * x + c * y;
    }
    for (int k = 0; k < MECH_MODES; k++) {
        double x = a[p][k], y = a[q][k];
        a[p][k] = c * x - s * y;
        a[q][k] = s * x + c * y;
        x = vectors[p][k];
        y = vectors[q][k];
        vectors[p][k] = c * x - s * y;
        vectors[q][k] = s * x + c * y;
    }
    return true;
}

/* Eigenvalues and eigenvectors (rows) of a symmetric matrix, by Jacobi's rotations; a is used up. */
static void mech_vibration_eigen(square a, square vectors, double values[MECH_MODES])
{
    memset(vectors, 0, sizeof(square));
    for (int k = 0; k < MECH_MODES; k++)
        vectors[k][k] = 1;
    bool turned = true;
    for (int sweep = 0; turned && sweep < SWEEPS; sweep++) {
        turned = false;
        for (int p = 0; p < MECH_MODES; p++)
            for (int q = p + 1; q < MECH_MODES; q++)
                turned = mech_vibration_rotate(a, vectors, p, q) || turned;
    }
    for (int k = 0; k < MECH_MODES; k++)
        values[k] = a[k][k];
}

/* Free or pinned modes and what they couple to; residual: static compliance and moment the modes leave out. */
static void mech_vibration_set_free(struct mech_basis *basis, const struct mech_modes *modes,
                                    const double z[MECH_MODES], double left_compliance, double left_moment)
{
    memset(basis->mode, 0, sizeof basis->mode);
    for (int k = 0; k < MECH_MODES; k++) {
        basis->mode[k][k] = 1;
        basis->omega[k] = modes->omega[k];
        basis->settle[k] = z[k] / (modes->omega[k] * modes->omega[k]);
        basis->moment[k] = modes->moment[k];
        basis->answer[k] = z[k];
        basis->turn[k] = -modes->turn[k];
    }
    basis->moment_input = left_moment;
    basis->answer_input = left_compliance;
}

static void mech_vibration_set_pinned(struct mech_basis *basis, const struct mech_modes *modes,
                                      const double z[MECH_MODES], double left_compliance, double left_moment)
{
    square stiffness;
    double values[MECH_MODES];
    for (int i = 0; i < MECH_MODES; i++)
        for (int j = 0; j < MECH_MODES; j++)
            stiffness[i][j] = z[i] * z[j] / left_compliance + (i == j ? modes->omega[i] * modes->omega[i] : 0);
    mech_vibration_eigen(stiffness, basis->mode, values);
    for (int k = 0; k < MECH_MODES; k++) {
        double zk = mech_vibration_dot(basis->mode[k], z);
        basis->omega[k] = sqrt(values[k]);
        basis->settle[k] = zk / left_compliance / values[k];
        basis->moment[k] = mech_vibration_dot(basis->mode[k], modes->moment) - left_moment * zk / left_compliance;
        basis->answer[k] = -zk / left_compliance;
        basis->turn[k] = -mech_vibration_dot(basis->mode[k], modes->turn);
    }
    basis->moment_input = left_moment / left_compliance;
    basis->answer_input = 1 / left_compliance;
}

/* Damped free motion: x'' + 2 damping omega x' + omega^2 x = 0 over a time. */
static void mech_vibration_step_of(double omega, double damping, double time_s, double step[4])
{
    double shrink = sqrt(1 - damping * damping), turns = omega * shrink;
    double fade = exp(-damping * omega * time_s), c = fade * cos(turns * time_s), s = fade * sin(turns * time_s);
    step[0] = c + damping / shrink * s;
    step[1] = s / turns;
    step[2] = -omega / shrink * s;
    step[3] = c - damping / shrink * s;
}

static void mech_vibration_set_steps(struct mech_basis *basis, double damping, double tick_s)
{
    basis->tick_s = tick_s;
    basis->damping = damping;
    for (int k = 0; k < MECH_MODES; k++) {
        double step[4];
        mech_vibration_step_of(basis->omega[k], damping, tick_s, step);
        for (int i = 0; i < 4; i++)
            basis->step[i][k] = step[i];
    }
}

/* What the place says of both: what a touch there couples to, and what follows. */
static void mech_vibration_set_place(const struct mech_whisker *whisker, const struct mech_modes *modes, double s,
                                     bool pinned, const double z[MECH_MODES], struct mech_basis *basis)
{
    double left_compliance = mech_modes_compliance(whisker, s, s), whole = left_compliance, left_moment = s;
    for (int k = 0; k < MECH_MODES; k++) {
        double square_omega = modes->omega[k] * modes->omega[k];
        left_compliance -= z[k] * z[k] / square_omega;
        left_moment -= z[k] * modes->moment[k] / square_omega;
    }
    left_compliance = fmax(left_compliance, 1e-9 * whole);
    basis->pinned = pinned;
    basis->s = s;
    (pinned ? mech_vibration_set_pinned : mech_vibration_set_free)(basis, modes, z, left_compliance, left_moment);
    for (int k = 0; k < MECH_MODES; k++)
        basis->lag[k] = basis->settle[k] * 2 * whisker->damping / basis->omega[k];
    basis->moment_static = basis->moment_input + mech_vibration_dot(basis->moment, basis->settle);
    basis->answer_static = basis->answer_input + mech_vibration_dot(basis->answer, basis->settle);
}

void mech_basis_of(const struct mech_whisker *whisker, const struct mech_modes *modes, bool pinned, double s,
                   double tick_s, struct mech_basis *basis)
{
    double z[MECH_MODES];
    mech_modes_at(whisker, modes, s, z);
    mech_vibration_set_place(whisker, modes, s, pinned, z, basis);
    mech_vibration_set_steps(basis, whisker->damping, tick_s);
}

void mech_basis_move(const struct mech_whisker *whisker, const struct mech_modes *modes, double s,
                     struct mech_basis *free, struct mech_basis *pinned)
{
    double z[MECH_MODES];
    mech_modes_at(whisker, modes, s, z);
    mech_vibration_set_place(whisker, modes, s, false, z, free);
    mech_vibration_set_place(whisker, modes, s, true, z, pinned);
    mech_vibration_set_steps(pinned, whisker->damping, pinned->tick_s);
}

/* One mode over a time: about the solution that follows the input, settle input - lag rate. */
static void mech_vibration_step_mode(const struct mech_basis *basis, struct mech_motion *motion, int k,
                                     const double step[4], double rate, double input)
{
    double behind = basis->lag[k] * rate, follow = basis->settle[k] * rate;
    double at = motion->at[k] - basis->settle[k] * motion->input + behind, speed = motion->speed[k] - follow;
    motion->at[k] = step[0] * at + step[1] * speed + basis->settle[k] * input - behind;
    motion->speed[k] = step[2] * at + step[3] * speed + follow;
}

void mech_basis_step(const struct mech_basis *basis, struct mech_motion *motion, double input)
{
    double rate = (input - motion->input) / basis->tick_s;
    for (int k = 0; k < MECH_MODES; k++) {
        const double step[4] = {basis->step[0][k], basis->step[1][k], basis->step[2][k], basis->step[3][k]};
        mech_vibration_step_mode(basis, motion, k, step, rate, input);
    }
    motion->input = input;
}

void mech_basis_step_part(const struct mech_basis *basis, struct mech_motion *motion, double input, double time_s)
{
    double rate = time_s > 0 ? (input - motion->input) / time_s : 0;
    for (int k = 0; k < MECH_MODES; k++) {
        double step[4];
        mech_vibration_step_of(basis->omega[k], basis->damping, time_s, step);
        mech_vibration_step_mode(basis, motion, k, step, rate, input);
    }
    motion->input = input;
}

void mech_basis_land(const struct mech_basis *free, const struct mech_basis *pinned, struct mech_motion *before,
                     double from, double to)
{
    struct mech_motion after = *before;
    mech_basis_step(free, &after, 0);
    double apart = mech_basis_answer(free, before) - from, over = to - mech_basis_answer(free, &after);
    double share = apart * over > 0 ? apart / (apart + over) : 0;
    mech_basis_step_part(free, before, 0, share * free->tick_s);
    mech_basis_change(free, pinned, before, from + share * (to - from));
    mech_basis_step_part(pinned, before, to, (1 - share) * free->tick_s);
}

static void mech_vibration_turn_over(const struct mech_basis *from, const struct mech_basis *to,
                                     double value[MECH_MODES])
{
    double free[MECH_MODES] = {0};
    for (int k = 0; k < MECH_MODES; k++)
        for (int j = 0; j < MECH_MODES; j++)
            free[j] += from->mode[k][j] * value[k];
    for (int k = 0; k < MECH_MODES; k++)
        value[k] = mech_vibration_dot(to->mode[k], free);
}

void mech_basis_change(const struct mech_basis *from, const struct mech_basis *to, struct mech_motion *motion,
                       double input)
{
    mech_vibration_turn_over(from, to, motion->at);
    mech_vibration_turn_over(from, to, motion->speed);
    motion->input = input;
}

void mech_basis_settle(const struct mech_basis *basis, double input, double rate, struct mech_motion *motion)
{
    for (int k = 0; k < MECH_MODES; k++) {
        motion->at[k] = basis->settle[k] * input - basis->lag[k] * rate;
        motion->speed[k] = basis->settle[k] * rate;
    }
    motion->input = input;
}

void mech_basis_turn(const struct mech_basis *basis, struct mech_motion *motion, double jump)
{
    for (int k = 0; k < MECH_MODES; k++)
        motion->speed[k] += basis->turn[k] * jump;
}

double mech_basis_moment(const struct mech_basis *basis, const struct mech_motion *motion)
{
    return mech_vibration_dot(basis->moment, motion->at) + basis->moment_input * motion->input;
}

double mech_basis_answer(const struct mech_basis *basis, const struct mech_motion *motion)
{
    return mech_vibration_dot(basis->answer, motion->at) + basis->answer_input * motion->input;
}

double mech_basis_swing(const struct mech_basis *basis, const struct mech_motion *motion)
{
    double sum = 0;
    for (int k = 0; k < MECH_MODES; k++) {
        double at = motion->at[k] - basis->settle[k] * motion->input;
        sum += fabs(basis->moment[k]) * (fabs(at) + fabs(motion->speed[k]) / basis->omega[k]);
    }
    return sum / (1 - basis->damping);
}
