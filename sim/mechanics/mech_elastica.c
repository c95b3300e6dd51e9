#include "mech_elastica.h"

#include <math.h>
#include <stdlib.h>

#include "nav_cubic.h"

#define LARGEST_SLOPE 2.65 /* rad: beyond every fold from 0.1 cones on */
#define SEARCH_STEP 0.05
#define LEAST_X 0.10
#define LARGEST_X 0.86
#define TABLE_NU 0.6 /* the quadratic in nu runs through -TABLE_NU, 0, TABLE_NU */
#define TINY_SLOPE 1e-9

enum { DISTANCES = 40, SLOPES = 54, FIELDS = 3, POWERS = 3, VALUES = FIELDS * POWERS, STEPS = 48 };
_Static_assert((int)VALUES == (int)MECH_VALUES, "a row holds every value");
enum { ANGLE, MOMENT, SLIDE }; /* fields: theta/slope, moment/slope, (arc - x)/slope^2 */

/* Tangent angle and position, seen from the contact: angle 0 and origin there. */
struct point {
    double angle, x, y;
};

/* Derivative along q = -log(1 - s), which spreads steps by the local diameter: ds = (1 - s) dq. The force on the beam
 * at the origin is force (nu, 1). */
static struct point mech_elastica_derivative(struct point at, double left, double force, double nu)
{
    double moment = force * (nu * at.y - at.x);
    return (struct point){moment / (left * left * left), left * cos(at.angle), left * sin(at.angle)};
}

static struct point mech_elastica_add(struct point a, struct point b, double scale)
{
    return (struct point){a.angle + scale * b.angle, a.x + scale * b.x, a.y + scale * b.y};
}

struct mech_bend mech_elastica_bend(double arc, double force, double nu, int steps)
{
    struct point at = {0, 0, 0};
    double h = log(1 - arc) / steps; /* negative: from the contact to the base */
    double left = 1 - arc, half = exp(-h / 2);
    for (int i = 0; i < steps; i++) {
        struct point k1 = mech_elastica_derivative(at, left, force, nu);
        struct point k2 = mech_elastica_derivative(mech_elastica_add(at, k1, h / 2), left * half, force, nu);
        struct point k3 = mech_elastica_derivative(mech_elastica_add(at, k2, h / 2), left * half, force, nu);
        left *= half * half;
        struct point k4 = mech_elastica_derivative(mech_elastica_add(at, k3, h), left, force, nu);
        at = mech_elastica_add(
            mech_elastica_add(mech_elastica_add(mech_elastica_add(at, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6);
    }
    /* Seen from the base: turned by the slope. */
    double slope = -at.angle, c = cos(slope), s = sin(slope);
    double px = -c * at.x + s * at.y, py = -s * at.x - c * at.y;
    return (struct mech_bend){hypot(px, py), atan2(py, px), slope, force * (nu * at.y - at.x), force, arc};
}

/* Small deflections: slope at the contact per force. */
static double mech_elastica_softness(double arc)
{
    double left = 1 - arc;
    return -0.5 + left / 3 + 1 / (6 * left * left);
}

bool mech_elastica_at_slope(double x, double slope, double nu, int steps, const struct mech_bend *from,
                            struct mech_bend *bend)
{
    double arc = from && from->arc > 0 ? from->arc : x;
    double force = from && from->arc > 0 ? from->force : slope / mech_elastica_softness(x);
    for (int i = 0; i < 40; i++) {
        *bend = mech_elastica_bend(arc, force, nu, steps);
        double ex = x - bend->x, es = slope - bend->slope;
        if (fabs(ex) < 1e-11 && fabs(es) < 1e-11)
            return true;
        double da = 1e-6 * (1 - arc), df = 1e-6 * force;
        struct mech_bend a = mech_elastica_bend(arc + da, force, nu, steps);
        struct mech_bend f = mech_elastica_bend(arc, force + df, nu, steps);
        double xa = (a.x - bend->x) / da, sa = (a.slope - bend->slope) / da;
        double xf = (f.x - bend->x) / df, sf = (f.slope - bend->slope) / df;
        double det = xa * sf - xf * sa;
        double move_arc = (ex * sf - xf * es) / det, move_force = (xa * es - sa * ex) / det;
        double most = fmax(fabs(move_arc) / (0.3 * (1 - arc)), fabs(move_force) / (0.5 * force));
        double scale = most > 1 ? 1 / most : 1;
        if (!isfinite(most))
            return false;
        arc += scale * move_arc;
        force += scale * move_force;
    }
    return false;
}

bool mech_elastica_at_angle(double x, double theta, double nu, int steps, struct mech_bend *bend)
{
    struct mech_bend low = {.arc = 0}, high;
    for (double slope = SEARCH_STEP;; slope += SEARCH_STEP) {
        if (slope > LARGEST_SLOPE || !mech_elastica_at_slope(x, slope, nu, steps, &low, &high) ||
            high.theta < low.theta)
            return false;
        if (high.theta >= theta)
            break;
        low = high;
    }
    for (int i = 0; i < 60; i++) { /* bisection: theta grows with the slope in between */
        double slope = (low.slope + high.slope) / 2;
        if (!mech_elastica_at_slope(x, slope, nu, steps, &high, bend))
            return false;
        if (fabs(bend->theta - theta) < 1e-12)
            return true;
        *(bend->theta < theta ? &low : &high) = *bend;
    }
    return true;
}

static const double X_STEP = (LARGEST_X - LEAST_X) / (DISTANCES - 1);
static const double SLOPE_STEP = LARGEST_SLOPE / (SLOPES - 1);

/* Value of field f: sum of node[f * POWERS + p] nu^p. */
struct mech_table {
    double node[DISTANCES][SLOPES][VALUES];
};

static double mech_elastica_held(double value, double low, double high)
{
    return fmin(fmax(value, low), high);
}

/* The fields at a point of the branch, with derivatives by slope and by nu. */
struct branch {
    double theta, theta_slope, theta_nu;
    double moment, moment_slope, moment_nu;
    double arc, arc_slope, arc_nu;
};

/* The table's rows at a distance for four slopes; kept in the hold while they serve. */
static void mech_elastica_fetch(const struct mech_table *table, double x, int first, struct mech_hold *hold)
{
    if (hold->x == x && hold->first == first)
        return;
    struct nav_cubic c = nav_cubic_at((x - LEAST_X) / X_STEP, DISTANCES);
    hold->x = x;
    hold->first = first;
    for (int j = 0; j < MECH_ROWS; j++)
        for (int v = 0; v < VALUES; v++)
            hold->row[j][v] = c.weight[0] * table->node[c.first][first + j][v] +
                              c.weight[1] * table->node[c.first + 1][first + j][v] +
                              c.weight[2] * table->node[c.first + 2][first + j][v] +
                              c.weight[3] * table->node[c.first + 3][first + j][v];
}

static void mech_elastica_interpolate(const struct mech_table *table, double x, double slope, struct mech_hold *hold,
                                      double value[VALUES], double change[VALUES])
{
    struct nav_cubic c = nav_cubic_at(slope / SLOPE_STEP, SLOPES);
    mech_elastica_fetch(table, x, c.first, hold);
    for (int v = 0; v < VALUES; v++) {
        value[v] = c.weight[0] * hold->row[0][v] + c.weight[1] * hold->row[1][v] + c.weight[2] * hold->row[2][v] +
                   c.weight[3] * hold->row[3][v];
        change[v] = (c.slope[0] * hold->row[0][v] + c.slope[1] * hold->row[1][v] + c.slope[2] * hold->row[2][v] +
                     c.slope[3] * hold->row[3][v]) /
                    SLOPE_STEP;
    }
}

static struct branch mech_elastica_branch_at(const struct mech_table *table, double x, double slope, double nu,
                                             struct mech_hold *hold)
{
    double value[VALUES], change[VALUES], f[FIELDS], f_slope[FIELDS], f_nu[FIELDS];
    mech_elastica_interpolate(table, x, slope, hold, value, change);
    for (int i = 0; i < FIELDS; i++) {
        const double *c = value + i * POWERS, *d = change + i * POWERS;
        f[i] = c[0] + nu * (c[1] + nu * c[2]);
        f_slope[i] = d[0] + nu * (d[1] + nu * d[2]);
        f_nu[i] = c[1] + 2 * nu * c[2];
    }
    return (struct branch){
        .theta = slope * f[ANGLE],
        .theta_slope = f[ANGLE] + slope * f_slope[ANGLE],
        .theta_nu = slope * f_nu[ANGLE],
        .moment = slope * f[MOMENT],
        .moment_slope = f[MOMENT] + slope * f_slope[MOMENT],
        .moment_nu = slope * f_nu[MOMENT],
        .arc = x + slope * slope * f[SLIDE],
        .arc_slope = slope * (2 * f[SLIDE] + slope * f_slope[SLIDE]),
        .arc_nu = slope * slope * f_nu[SLIDE],
    };
}

/* Turns samples at -TABLE_NU, 0, TABLE_NU into coefficients. */
static void mech_elastica_set_node(double *coefficient, const double sample[3])
{
    coefficient[0] = sample[1];
    coefficient[1] = (sample[2] - sample[0]) / (2 * TABLE_NU);
    coefficient[2] = ((sample[2] + sample[0]) / 2 - sample[1]) / (TABLE_NU * TABLE_NU);
}

static void mech_elastica_fill_distance(struct mech_table *table, int i)
{
    double x = LEAST_X + i * X_STEP;
    struct mech_bend near[3] = {{0}};
    for (int j = 0; j < SLOPES; j++) {
        double slope = j > 0 ? j * SLOPE_STEP : 1e-3; /* the fields at 0 are limits */
        double sample[FIELDS][3];
        for (int n = 0; n < 3; n++) {
            struct mech_bend bend = near[n];
            /* Where Newton's method fails the last bend stands in: that is beyond every tip. */
            if (mech_elastica_at_slope(x, slope, (n - 1) * TABLE_NU, STEPS, j > 0 ? &near[n] : NULL, &bend))
                near[n] = bend;
            bend = near[n];
            sample[ANGLE][n] = bend.theta / bend.slope;
            sample[MOMENT][n] = bend.moment / bend.slope;
            sample[SLIDE][n] = (bend.arc - bend.x) / (bend.slope * bend.slope);
        }
        for (int f = 0; f < FIELDS; f++)
            mech_elastica_set_node(&table->node[i][j][f * POWERS], sample[f]);
    }
}

mech_table *mech_table_new(void)
{
    struct mech_table *table = calloc(1, sizeof *table);
    for (int i = 0; table && i < DISTANCES; i++)
        mech_elastica_fill_distance(table, i);
    return table;
}

void mech_table_free(mech_table *table)
{
    free(table);
}

/* The angle a state imposes, the tilt of the plug included; the plug stops at a tilt. */
struct imposed {
    double theta, by_slope, by_nu;
};

static struct imposed mech_elastica_imposed_by(const struct branch *at, const struct mech_whisker *whisker)
{
    double soft = 1 / (3 * whisker->kappa), tilt = soft * at->moment;
    if (tilt > whisker->stop)
        return (struct imposed){at->theta + whisker->stop, at->theta_slope, at->theta_nu};
    return (struct imposed){at->theta + tilt, at->theta_slope + soft * at->moment_slope,
                            at->theta_nu + soft * at->moment_nu};
}

static bool mech_elastica_slid_off(const struct branch *at, const struct mech_whisker *whisker)
{
    return at->arc > whisker->length / whisker->cone;
}

/* Newton's method for the slope at fixed nu. false beyond the fold. */
static bool mech_elastica_solve_slope(const mech_table *table, const struct mech_whisker *whisker, double x,
                                      double theta, double nu, struct mech_hold *hold, struct branch *at)
{
    for (int i = 0; i < 30; i++) {
        *at = mech_elastica_branch_at(table, x, hold->slope, nu, hold);
        struct imposed imposed = mech_elastica_imposed_by(at, whisker);
        if (imposed.by_slope <= 0 || hold->slope > LARGEST_SLOPE)
            return false;
        double error = theta - imposed.theta;
        if (fabs(error) < 1e-10)
            return true;
        double move = error / imposed.by_slope;
        hold->slope = fmax(TINY_SLOPE, hold->slope + mech_elastica_held(move, -0.2, 0.2));
    }
    return false;
}

/* The friction ratio at which the contact would stay where it is on the beam, to first order about this state, with the
 * slope following so that theta stays. */
static double mech_elastica_sticking_nu(const struct branch *at, const struct mech_whisker *whisker, double nu,
                                        double arc)
{
    struct imposed imposed = mech_elastica_imposed_by(at, whisker);
    double by_nu = at->arc_nu - at->arc_slope * imposed.by_nu / imposed.by_slope;
    double slid = at->arc - arc;
    if (fabs(by_nu) > 1e-12 && isfinite(by_nu))
        return nu - slid / by_nu;
    return slid > 0 ? INFINITY : slid < 0 ? -INFINITY : nu;
}

bool mech_table_moment(const mech_table *table, const struct mech_whisker *whisker, double a, double theta,
                       struct mech_hold *hold, double *moment)
{
    double x = mech_elastica_held(a / whisker->cone, LEAST_X, LARGEST_X), most = fmin(whisker->friction, TABLE_NU);
    double unit = mech_whisker_bending(whisker) / whisker->cone;
    bool fresh = hold->slope <= 0;
    struct mech_hold now = *hold;
    struct branch at;
    now.slope = fmax(TINY_SLOPE, fresh ? theta : now.slope);
    now.nu = fresh ? most : mech_elastica_held(now.nu, -most, most); /* a fresh contact slides towards the tip */
    if (!mech_elastica_solve_slope(table, whisker, x, theta, now.nu, &now, &at)) {
        now.slope = hold->slope; /* friction towards the tip holds the whisker longest */
        now.nu = most;
        if (!mech_elastica_solve_slope(table, whisker, x, theta, most, &now, &at))
            return false;
    }
    /* Sticking is tried first; what friction cannot hold slides at its limit. */
    double wanted =
        fresh ? most : mech_elastica_held(mech_elastica_sticking_nu(&at, whisker, now.nu, hold->arc), -most, most);
    if (fabs(wanted - now.nu) > 1e-9) {
        struct mech_hold slid = now;
        slid.nu = wanted;
        if (mech_elastica_solve_slope(table, whisker, x, theta, wanted, &slid, &at))
            now = slid;
        else if (!mech_elastica_solve_slope(table, whisker, x, theta, now.nu, &now, &at))
            return false;
    }
    now.arc = at.arc;
    if (mech_elastica_slid_off(&at, whisker))
        return false;
    *hold = now;
    *moment = unit * at.moment;
    return true;
}
