#include "contact_beam.h"

#include <math.h>
#include <string.h>

#include "nav_cubic.h"
#include "pose.h"

enum { STEPS = 32 };
enum { ACROSS, TURN, SHORT }; /* fields: y/slope, moment/slope, (arc - x)/slope^2 */

#define LEAST_ARC 0.10
#define LARGEST_SLOPE 1.4
#define TABLE_NU 0.5 /* the quadratic in nu runs through -TABLE_NU, 0, TABLE_NU */
#define LEAST_DIRECTION 0.6
#define LEAST_LEFT 0.35 /* rad between force and whisker at the tip */
#define LEAST_TIP 0.3
#define LARGEST_TIP 0.85
#define FIRST_SLOPE 1e-3 /* the fields at slope 0 are limits */

/* Seen from the contact: angle of the tangent, and place. */
struct point {
    double angle, x, y;
};

struct shape {
    double slope, x, y, moment;
};

/* Integrates over q, where ds = (1 - s) dq spreads the steps by the diameter: bending is moment over (1 - s)^4. */
static struct point beam_derivative(struct point at, double left, double along, double across)
{
    double moment = along * at.y - across * at.x;
    return (struct point){moment / (left * left * left), left * cos(at.angle), left * sin(at.angle)};
}

static struct point beam_moved(struct point at, struct point by, double h)
{
    return (struct point){at.angle + h * by.angle, at.x + h * by.x, at.y + h * by.y};
}

/* The shape under a force at an arc length, from the contact to the base by Runge and Kutta's fourth order. */
static struct shape beam_shape(double arc, double along, double across)
{
    struct point at = {0};
    double h = log(1.0 - arc) / STEPS, left = 1.0 - arc, half = exp(-0.5 * h);
    for (int i = 0; i < STEPS; i++) {
        struct point k1 = beam_derivative(at, left, along, across);
        struct point k2 = beam_derivative(beam_moved(at, k1, 0.5 * h), left * half, along, across);
        struct point k3 = beam_derivative(beam_moved(at, k2, 0.5 * h), left * half, along, across);
        left *= half * half;
        struct point k4 = beam_derivative(beam_moved(at, k3, h), left, along, across);
        at = beam_moved(beam_moved(beam_moved(beam_moved(at, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6);
    }
    double slope = -at.angle, c = cos(slope), s = sin(slope);
    return (struct shape){slope, -c * at.x + s * at.y, -s * at.x - c * at.y, along * at.y - across * at.x};
}

/* The shape with a slope at the contact, by the secant method; *force goes on from the last slope's. */
static struct shape beam_at_slope(double arc, double slope, double nu, double *force)
{
    double low = 0.0, low_slope = 0.0, f = *force;
    struct shape shape = {0};
    for (int i = 0; i < 60; i++) {
        shape = beam_shape(arc, nu * f, f);
        if (fabs(shape.slope - slope) < 1e-10 || shape.slope == low_slope)
            break;
        double next = f + (slope - shape.slope) * (f - low) / (shape.slope - low_slope);
        low = f;
        low_slope = shape.slope;
        f = fmin(fmax(next, 0.3 * f), 3.0 * f);
    }
    *force = f;
    return shape;
}

/* Force across a straight beam per slope at the contact. */
static double beam_stiffness(double arc)
{
    double left = 1.0 - arc;
    return 1.0 / (-0.5 + left / 3 + 1.0 / (6 * left * left));
}

static void beam_fields(double arc, double slope, struct shape at, double field[NAV_BEAM_FIELDS])
{
    field[ACROSS] = at.y / slope;
    field[TURN] = at.moment / slope;
    field[SHORT] = (arc - at.x) / (slope * slope);
}

static double beam_slope(int j)
{
    return j > 0 ? LARGEST_SLOPE * j / (NAV_BEAM_SLOPES - 1) : FIRST_SLOPE;
}

static void beam_fill_arc(struct nav_contact_beam *beam, int i)
{
    double arc = LEAST_ARC + (beam->tip - LEAST_ARC) * i / (NAV_BEAM_ARCS - 1), force[NAV_BEAM_POWERS];
    for (int n = 0; n < NAV_BEAM_POWERS; n++)
        force[n] = FIRST_SLOPE * beam_stiffness(arc);
    for (int j = 0; j < NAV_BEAM_SLOPES; j++) {
        double slope = beam_slope(j), field[NAV_BEAM_POWERS][NAV_BEAM_FIELDS];
        for (int n = 0; n < NAV_BEAM_POWERS; n++)
            beam_fields(arc, slope, beam_at_slope(arc, slope, (n - 1) * TABLE_NU, &force[n]), field[n]);
        for (int f = 0; f < NAV_BEAM_FIELDS; f++) {
            float *out = beam->shaft[i][j] + f * NAV_BEAM_POWERS;
            out[0] = (float)field[1][f];
            out[1] = (float)((field[2][f] - field[0][f]) / (2 * TABLE_NU));
            out[2] = (float)((0.5 * (field[2][f] + field[0][f]) - field[1][f]) / (TABLE_NU * TABLE_NU));
        }
    }
}

/* Slopes of a direction go up to where force and whisker are nearly parallel. */
static double beam_most(double direction)
{
    return fmin(LARGEST_SLOPE, direction - LEAST_LEFT);
}

static void beam_fill_direction(struct nav_contact_beam *beam, int i)
{
    double direction = LEAST_DIRECTION + (NAV_BEAM_DIRECTION - LEAST_DIRECTION) * i / (NAV_BEAM_DIRECTIONS - 1);
    double force = FIRST_SLOPE * beam_stiffness(beam->tip);
    for (int j = 0; j < NAV_BEAM_SLOPES; j++) {
        double share = j > 0 ? (double)j / (NAV_BEAM_SLOPES - 1) : FIRST_SLOPE, field[NAV_BEAM_FIELDS];
        double slope = share * beam_most(direction), nu = tan(slope + 0.5 * NAV_PI - direction);
        beam_fields(beam->tip, slope, beam_at_slope(beam->tip, slope, nu, &force), field);
        for (int f = 0; f < NAV_BEAM_FIELDS; f++)
            beam->end[i][j][f] = (float)field[f];
    }
}

bool nav_contact_beam_make(struct nav_contact_beam *beam, double tip)
{
    memset(beam, 0, sizeof *beam);
    if (!(tip >= LEAST_TIP && tip <= LARGEST_TIP))
        return false;
    beam->tip = tip;
    for (int i = 0; i < NAV_BEAM_ARCS; i++)
        beam_fill_arc(beam, i);
    for (int i = 0; i < NAV_BEAM_DIRECTIONS; i++)
        beam_fill_direction(beam, i);
    return true;
}

/* Sums of a table's values over 16 nodes: by weights, by slopes in the first and in the second coordinate. */
#define BEAM_SUMS(table, lanes, ci, cj, sum)                                                                           \
    for (int i = 0; i < 4; i++)                                                                                        \
        for (int j = 0; j < 4; j++) {                                                                                  \
            const float *node = (table)[(ci).first + i][(cj).first + j];                                               \
            float w = (float)((ci).weight[i] * (cj).weight[j]), u = (float)((ci).slope[i] * (cj).weight[j]),           \
                  v = (float)((ci).weight[i] * (cj).slope[j]);                                                         \
            for (int n = 0; n < (lanes); n++) {                                                                        \
                (sum)[0][n] += w * node[n];                                                                            \
                (sum)[1][n] += u * node[n];                                                                            \
                (sum)[2][n] += v * node[n];                                                                            \
            }                                                                                                          \
        }

/* Makes place and moment of the fields f and their derivatives. arc: contact's; arc_1: its derivative. */
static void beam_bend(double arc, double arc_1, double slope, double f[4][NAV_BEAM_FIELDS],
                      struct nav_contact_bend *bend)
{
    bend->x = arc - slope * slope * f[0][SHORT];
    bend->y = slope * f[0][ACROSS];
    bend->moment = slope * f[0][TURN];
    for (int k = 0; k < 3; k++) {
        bend->by[k][0] = (k == 0 ? arc_1 : 0.0) - slope * slope * f[1 + k][SHORT];
        bend->by[k][1] = slope * f[1 + k][ACROSS];
        bend->by[k][2] = slope * f[1 + k][TURN];
    }
    bend->by[1][0] -= 2.0 * slope * f[0][SHORT];
    bend->by[1][1] += f[0][ACROSS];
    bend->by[1][2] += f[0][TURN];
}

static bool beam_hold(double *value, double low, double high)
{
    double given = *value;
    *value = fmin(fmax(given, low), high);
    return *value == given;
}

bool nav_contact_beam_shaft(const struct nav_contact_beam *beam, double arc, double slope, double nu,
                            struct nav_contact_bend *bend)
{
    bool inside = beam_hold(&arc, LEAST_ARC, beam->tip);
    inside = beam_hold(&slope, -LARGEST_SLOPE, LARGEST_SLOPE) && inside;
    inside = beam_hold(&nu, -TABLE_NU, TABLE_NU) && inside;
    double per_arc = (NAV_BEAM_ARCS - 1) / (beam->tip - LEAST_ARC), per_slope = (NAV_BEAM_SLOPES - 1) / LARGEST_SLOPE;
    struct nav_cubic ci = nav_cubic_at((arc - LEAST_ARC) * per_arc, NAV_BEAM_ARCS);
    struct nav_cubic cj = nav_cubic_at(fmax(slope, 0.0) * per_slope, NAV_BEAM_SLOPES);
    float sum[3][NAV_BEAM_VALUES + 3] = {{0}};
    BEAM_SUMS(beam->shaft, NAV_BEAM_VALUES + 3, ci, cj, sum)
    double f[4][NAV_BEAM_FIELDS];
    for (int n = 0; n < NAV_BEAM_FIELDS; n++) {
        const double scale[3] = {1.0, per_arc, slope > 0.0 ? per_slope : 0.0};
        for (int k = 0; k < 3; k++) {
            const float *c = sum[k] + n * NAV_BEAM_POWERS;
            f[k][n] = scale[k] * (c[0] + nu * (c[1] + nu * c[2]));
        }
        f[3][n] = sum[0][n * NAV_BEAM_POWERS + 1] + 2.0 * nu * sum[0][n * NAV_BEAM_POWERS + 2];
    }
    beam_bend(arc, 1.0, slope, f, bend);
    return inside;
}

bool nav_contact_beam_end(const struct nav_contact_beam *beam, double direction, double slope,
                          struct nav_contact_bend *bend)
{
    bool inside = beam_hold(&direction, LEAST_DIRECTION, NAV_BEAM_DIRECTION);
    double most = beam_most(direction), most_by = direction - LEAST_LEFT < LARGEST_SLOPE ? 1.0 : 0.0;
    inside = beam_hold(&slope, -LARGEST_SLOPE, most) && inside;
    double per_direction = (NAV_BEAM_DIRECTIONS - 1) / (NAV_BEAM_DIRECTION - LEAST_DIRECTION);
    double per_slope = slope > 0.0 ? (NAV_BEAM_SLOPES - 1) / most : 0.0;
    struct nav_cubic ci = nav_cubic_at((direction - LEAST_DIRECTION) * per_direction, NAV_BEAM_DIRECTIONS);
    struct nav_cubic cj = nav_cubic_at(slope * per_slope, NAV_BEAM_SLOPES);
    float sum[3][4] = {{0}};
    BEAM_SUMS(beam->end, 4, ci, cj, sum)
    double f[4][NAV_BEAM_FIELDS] = {{0}};
    for (int n = 0; n < NAV_BEAM_FIELDS; n++) {
        f[0][n] = sum[0][n];
        f[2][n] = per_slope * sum[2][n];
        f[1][n] = per_direction * sum[1][n] - f[2][n] * slope / most * most_by;
    }
    beam_bend(beam->tip, 0.0, slope, f, bend);
    return inside;
}
