#include "mech_table.h"

#include <math.h>
#include <stdlib.h>

#include "mech_elastica.h"

enum { DISTANCES = 40, SLOPES = 54, FIELDS = 3, POWERS = 3, VALUES = FIELDS * POWERS, STEPS = 48 };
_Static_assert((int)VALUES == (int)MECH_VALUES, "a row holds every value");
enum { ANGLE, MOMENT, SLIDE }; /* fields: theta/slope, moment/slope, (arc - x)/slope^2 */

#define LEAST_X 0.10
#define LARGEST_X 0.86
#define LARGEST_SLOPE 2.65 /* rad: beyond the fold at the least distance */
#define TABLE_NU 0.6       /* the quadratic in nu runs through -TABLE_NU, 0, TABLE_NU */
#define WORST_CLOSED 0.05  /* the bound's coefficients hold up to this error */
#define TINY_SLOPE 1e-9

static const double X_STEP = (LARGEST_X - LEAST_X) / (DISTANCES - 1);
static const double SLOPE_STEP = LARGEST_SLOPE / (SLOPES - 1);

struct mech_table {
    double node[DISTANCES][SLOPES][VALUES]; /* value of field f: sum of [f * POWERS + p] nu^p */
    double curvature[DISTANCES], friction[DISTANCES], limit[DISTANCES];
};

/* Cubic Lagrange weights of four neighbours, and their derivatives per unit of the argument. */
struct cubic {
    int first;
    double weight[4], slope[4];
};

static struct cubic cubic_at(double position, int nodes)
{
    struct cubic c;
    c.first = (int)position - 1;
    c.first = c.first < 0 ? 0 : c.first > nodes - 4 ? nodes - 4 : c.first;
    double t = position - c.first, a = t - 1, b = t - 2, d = t - 3;
    c.weight[0] = -a * b * d / 6;
    c.weight[1] = t * b * d / 2;
    c.weight[2] = -t * a * d / 2;
    c.weight[3] = t * a * b / 6;
    c.slope[0] = -(b * d + a * d + a * b) / 6;
    c.slope[1] = (b * d + t * d + t * b) / 2;
    c.slope[2] = -(a * d + t * d + t * a) / 2;
    c.slope[3] = (a * b + t * b + t * a) / 6;
    return c;
}

static double held(double value, double low, double high)
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
static void fetch(const struct mech_table *table, double x, int first, struct mech_hold *hold)
{
    if (hold->x == x && hold->first == first)
        return;
    struct cubic c = cubic_at((x - LEAST_X) / X_STEP, DISTANCES);
    hold->x = x;
    hold->first = first;
    for (int j = 0; j < MECH_ROWS; j++)
        for (int v = 0; v < VALUES; v++)
            hold->row[j][v] = c.weight[0] * table->node[c.first][first + j][v] +
                              c.weight[1] * table->node[c.first + 1][first + j][v] +
                              c.weight[2] * table->node[c.first + 2][first + j][v] +
                              c.weight[3] * table->node[c.first + 3][first + j][v];
}

static void interpolate(const struct mech_table *table, double x, double slope, struct mech_hold *hold,
                        double value[VALUES], double change[VALUES])
{
    struct cubic c = cubic_at(slope / SLOPE_STEP, SLOPES);
    fetch(table, x, c.first, hold);
    for (int v = 0; v < VALUES; v++) {
        value[v] = c.weight[0] * hold->row[0][v] + c.weight[1] * hold->row[1][v] + c.weight[2] * hold->row[2][v] +
                   c.weight[3] * hold->row[3][v];
        change[v] = (c.slope[0] * hold->row[0][v] + c.slope[1] * hold->row[1][v] + c.slope[2] * hold->row[2][v] +
                     c.slope[3] * hold->row[3][v]) /
                    SLOPE_STEP;
    }
}

static struct branch branch_at(const struct mech_table *table, double x, double slope, double nu,
                               struct mech_hold *hold)
{
    double value[VALUES], change[VALUES], f[FIELDS], f_slope[FIELDS], f_nu[FIELDS];
    interpolate(table, x, slope, hold, value, change);
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
static void set_node(double *coefficient, const double sample[3])
{
    coefficient[0] = sample[1];
    coefficient[1] = (sample[2] - sample[0]) / (2 * TABLE_NU);
    coefficient[2] = ((sample[2] + sample[0]) / 2 - sample[1]) / (TABLE_NU * TABLE_NU);
}

static void fill_distance(struct mech_table *table, int i)
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
            set_node(&table->node[i][j][f * POWERS], sample[f]);
    }
}

/* Moment of the closed form for a clamped beam, in the beam's units. */
static double closed(double x, double theta)
{
    return 3 * theta * (1 / x - 1);
}

static void fill_bounds(struct mech_table *table, int i)
{
    double x = LEAST_X + i * X_STEP;
    double last = 0;
    struct mech_hold hold = {0};
    table->limit[i] = LARGEST_SLOPE;
    for (int j = 1; j <= 4 * (SLOPES - 1); j++) {
        double slope = j * SLOPE_STEP / 4;
        struct branch at = branch_at(table, x, slope, 0, &hold);
        double error = fabs(closed(x, at.theta) / at.moment - 1);
        if (at.moment <= last) {
            table->limit[i] = at.theta;
            break;
        }
        last = at.moment;
        if (error > WORST_CLOSED)
            continue;
        table->curvature[i] = fmax(table->curvature[i], error / (at.theta * at.theta));
        for (int side = -1; side <= 1; side += 2) {
            struct branch rough = branch_at(table, x, slope, side * TABLE_NU, &hold);
            double more =
                fabs(closed(x, rough.theta) / rough.moment - 1) - table->curvature[i] * rough.theta * rough.theta;
            table->friction[i] = fmax(table->friction[i], more / (TABLE_NU * rough.theta));
        }
    }
}

mech_table *mech_table_new(void)
{
    struct mech_table *table = calloc(1, sizeof *table);
    for (int i = 0; table && i < DISTANCES; i++)
        fill_distance(table, i);
    for (int i = 0; table && i < DISTANCES; i++)
        fill_bounds(table, i);
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

static struct imposed imposed_by(const struct branch *at, const struct mech_whisker *whisker)
{
    double soft = 1 / (3 * whisker->kappa), tilt = soft * at->moment;
    if (tilt > whisker->stop)
        return (struct imposed){at->theta + whisker->stop, at->theta_slope, at->theta_nu};
    return (struct imposed){at->theta + tilt, at->theta_slope + soft * at->moment_slope,
                            at->theta_nu + soft * at->moment_nu};
}

static bool slid_off(const struct branch *at, const struct mech_whisker *whisker)
{
    return at->arc > whisker->length / whisker->cone;
}

/* Newton's method for the slope at fixed nu. false beyond the fold. */
static bool solve_slope(const mech_table *table, const struct mech_whisker *whisker, double x, double theta, double nu,
                        struct mech_hold *hold, struct branch *at)
{
    for (int i = 0; i < 30; i++) {
        *at = branch_at(table, x, hold->slope, nu, hold);
        struct imposed imposed = imposed_by(at, whisker);
        if (imposed.by_slope <= 0 || hold->slope > LARGEST_SLOPE)
            return false;
        double error = theta - imposed.theta;
        if (fabs(error) < 1e-10)
            return true;
        double move = error / imposed.by_slope;
        hold->slope = fmax(TINY_SLOPE, hold->slope + held(move, -0.2, 0.2));
    }
    return false;
}

/* The friction ratio at which the contact would stay where it is on the beam, to first order about this state, with the
 * slope following so that theta stays. */
static double sticking_nu(const struct branch *at, const struct mech_whisker *whisker, double nu, double arc)
{
    struct imposed imposed = imposed_by(at, whisker);
    double by_nu = at->arc_nu - at->arc_slope * imposed.by_nu / imposed.by_slope;
    double slid = at->arc - arc;
    if (fabs(by_nu) > 1e-12 && isfinite(by_nu))
        return nu - slid / by_nu;
    return slid > 0 ? INFINITY : slid < 0 ? -INFINITY : nu;
}

bool mech_table_moment(const mech_table *table, const struct mech_whisker *whisker, double a, double theta,
                       struct mech_hold *hold, double *moment)
{
    double x = held(a / whisker->cone, LEAST_X, LARGEST_X), most = fmin(whisker->friction, TABLE_NU);
    double unit = mech_whisker_bending(whisker) / whisker->cone;
    bool fresh = hold->slope <= 0;
    struct mech_hold now = *hold;
    struct branch at;
    now.slope = fmax(TINY_SLOPE, fresh ? theta : now.slope);
    now.nu = fresh ? most : held(now.nu, -most, most); /* a fresh contact slides towards the tip */
    if (!solve_slope(table, whisker, x, theta, now.nu, &now, &at)) {
        now.slope = hold->slope; /* friction towards the tip holds the whisker longest */
        now.nu = most;
        if (!solve_slope(table, whisker, x, theta, most, &now, &at))
            return false;
    }
    /* Sticking is tried first; what friction cannot hold slides at its limit. */
    double wanted = fresh ? most : held(sticking_nu(&at, whisker, now.nu, hold->arc), -most, most);
    if (fabs(wanted - now.nu) > 1e-9) {
        struct mech_hold slid = now;
        slid.nu = wanted;
        if (solve_slope(table, whisker, x, theta, wanted, &slid, &at))
            now = slid;
        else if (!solve_slope(table, whisker, x, theta, now.nu, &now, &at))
            return false;
    }
    now.arc = at.arc;
    if (slid_off(&at, whisker))
        return false;
    *hold = now;
    *moment = unit * at.moment;
    return true;
}

/* The larger of the values at the neighbouring distances. */
static double worst_near(const double value[DISTANCES], double x)
{
    int i = (int)held((x - LEAST_X) / X_STEP, 0, DISTANCES - 2);
    return fmax(value[i], value[i + 1]);
}

struct mech_trust mech_table_trust(const mech_table *table, const struct mech_whisker *whisker, double a)
{
    double x = held(a / whisker->cone, LEAST_X, LARGEST_X), tip = whisker->length / whisker->cone;
    int i = (int)held((x - LEAST_X) / X_STEP, 0, DISTANCES - 2);
    struct mech_trust trust = {worst_near(table->curvature, x),
                               worst_near(table->friction, x) * fmin(whisker->friction, TABLE_NU),
                               fmin(table->limit[i], table->limit[i + 1])};
    struct mech_hold hold = {0};
    for (double slope = SLOPE_STEP / 2; slope < LARGEST_SLOPE; slope += SLOPE_STEP / 2) {
        struct branch at = branch_at(table, x, slope, 0, &hold);
        if (at.arc > tip) {
            trust.limit = fmin(trust.limit, at.theta);
            break;
        }
    }
    return trust;
}
