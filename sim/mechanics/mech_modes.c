#include "mech_modes.h"

#include <math.h>
#include <string.h>

#include "whisker_constants.h"

enum { BLOCK = MECH_MODES + 3, ROUNDS = 60 }; /* a few vectors more than wanted make the wanted ones converge */

/* Nodes and weights of Gauss-Legendre quadrature on 0..1: Newton's method on Legendre's polynomial. */
static void gauss_legendre(double node[MECH_NODES], double weight[MECH_NODES])
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
static double cone_integral(double a, double b)
{
    return (-1 + (a + b) / 2 - a * b / 3) - (-1 / a + (a + b) / (2 * a * a) - b / (3 * a * a));
}

double mech_modes_compliance(const struct mech_whisker *whisker, double s, double t)
{
    double near = fmin(s, t) / whisker->cone, far = fmax(s, t) / whisker->cone;
    double unit = whisker->cone * whisker->cone * whisker->cone / mech_whisker_bending(whisker);
    return unit * cone_integral(1 - near, 1 - far) + s * t * mech_whisker_compliance(whisker);
}

typedef double matrix[MECH_NODES][MECH_NODES];

/* Symmetric form of the integral equation: its eigenvalues are 1/omega^2. */
static void symmetric_form(const struct mech_whisker *whisker, const struct mech_modes *modes, matrix form)
{
    for (int i = 0; i < MECH_NODES; i++)
        for (int j = 0; j < MECH_NODES; j++)
            form[i][j] =
                sqrt(modes->mass[i] * modes->mass[j]) * mech_modes_compliance(whisker, modes->node[i], modes->node[j]);
}

static double dot(const double *a, const double *b)
{
    double sum = 0;
    for (int i = 0; i < MECH_NODES; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Gram and Schmidt; the squared length before is the last round's stretch. */
static void orthonormalise(double block[BLOCK][MECH_NODES], double stretch[BLOCK])
{
    for (int k = 0; k < BLOCK; k++) {
        for (int j = 0; j < k; j++) {
            double share = dot(block[k], block[j]);
            for (int i = 0; i < MECH_NODES; i++)
                block[k][i] -= share * block[j][i];
        }
        stretch[k] = sqrt(dot(block[k], block[k]));
        for (int i = 0; i < MECH_NODES; i++)
            block[k][i] /= stretch[k];
    }
}

static void lay_mass(const struct mech_whisker *whisker, struct mech_modes *modes)
{
    double weight[MECH_NODES];
    gauss_legendre(modes->node, weight);
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
    lay_mass(whisker, modes);
    symmetric_form(whisker, modes, form);
    for (int k = 0; k < BLOCK; k++)
        for (int i = 0; i < MECH_NODES; i++)
            block[k][i] = cos(SIM_PI * k * (i + 0.5) / MECH_NODES);
    for (int round = 0; round < ROUNDS; round++) {
        for (int k = 0; k < BLOCK; k++)
            for (int i = 0; i < MECH_NODES; i++)
                next[k][i] = dot(form[i], block[k]);
        memcpy(block, next, sizeof block);
        orthonormalise(block, stretch);
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
        shape[k] = modes->omega[k] * modes->omega[k] * dot(bend, modes->shape[k]);
}
