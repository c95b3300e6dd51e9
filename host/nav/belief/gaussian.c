#include "gaussian.h"

#include <math.h>
#include <string.h>

#include "problem.h"

enum { X, Y, T };

double nav_mode_distance(struct nav_pose mean, struct nav_pose pose)
{
    double dx = pose.x - mean.x, dy = pose.y - mean.y, turn = nav_wrap(pose.theta - mean.theta);
    return (dx * dx + dy * dy) / (NAV_NEAR_M * NAV_NEAR_M) + turn * turn / (NAV_NEAR_RAD * NAV_NEAR_RAD);
}

struct nav_gaussian nav_gaussian_uniform(const struct nav_arena *arena)
{
    /* Variance of a uniform distribution: width^2 / 12. */
    struct nav_gaussian g = {.mean = {arena->size_x / 2.0, arena->size_y / 2.0, 0.0}};
    g.covariance[0] = arena->size_x * arena->size_x / 12.0;
    g.covariance[4] = arena->size_y * arena->size_y / 12.0;
    g.covariance[8] = NAV_PI * NAV_PI / 3.0;
    return g;
}

void nav_gaussian_estimate(const struct nav_gaussian *g, struct nav_estimate *estimate)
{
    estimate->pose = g->mean;
    memcpy(estimate->covariance, g->covariance, sizeof g->covariance);
    estimate->confidence = nav_gaussian_mass(g, NAV_NEAR_M, NAV_NEAR_RAD);
}

void nav_gaussian_sum_add(struct nav_gaussian_sum *s, double mass, const struct nav_gaussian *g)
{
    const double off[3] = {g->mean.x - s->about.x, g->mean.y - s->about.y, nav_wrap(g->mean.theta - s->about.theta)};
    s->mass += mass;
    for (int r = 0; r < 3; r++)
        s->first[r] += mass * off[r];
    for (int r = 0; r < 9; r++)
        s->second[r] += mass * (g->covariance[r] + off[r / 3] * off[r % 3]);
}

struct nav_gaussian nav_gaussian_sum_moments(const struct nav_gaussian_sum *s)
{
    struct nav_gaussian g;
    double mean[3];
    for (int r = 0; r < 3; r++)
        mean[r] = s->first[r] / s->mass;
    for (int r = 0; r < 9; r++)
        g.covariance[r] = s->second[r] / s->mass - mean[r / 3] * mean[r % 3];
    g.mean = (struct nav_pose){s->about.x + mean[0], s->about.y + mean[1], nav_wrap(s->about.theta + mean[2])};
    return g;
}

void nav_gaussian_carry(struct nav_gaussian *g, const struct nav_arena *arena)
{
    struct nav_gaussian anywhere = nav_gaussian_uniform(arena);
    struct nav_gaussian_sum sum = {.about = g->mean};
    anywhere.mean.theta = g->mean.theta;
    nav_gaussian_sum_add(&sum, 1.0 - NAV_CARRIED, g);
    nav_gaussian_sum_add(&sum, NAV_CARRIED, &anywhere);
    *g = nav_gaussian_sum_moments(&sum);
}

void nav_gaussian_covariance(const struct nav_gaussian *g, struct nav_pose about, double out[9])
{
    const double off[3] = {g->mean.x - about.x, g->mean.y - about.y, nav_wrap(g->mean.theta - about.theta)};
    for (int k = 0; k < 9; k++)
        out[k] = g->covariance[k] + off[k / 3] * off[k % 3];
}

/* Cholesky factor of a covariance, lower triangular, row-major; what rounding has made negative counts as nothing. */
static void gaussian_root(const double p[9], double root[9])
{
    double a = sqrt(fmax(p[0], 1e-18)), b = p[3] / a, d = p[6] / a;
    double c = sqrt(fmax(p[4] - b * b, 1e-18)), e = (p[7] - d * b) / c;
    const double out[9] = {a, 0.0, 0.0, b, c, 0.0, d, e, sqrt(fmax(p[8] - d * d - e * e, 1e-18))};
    memcpy(root, out, sizeof out);
}

/* The pose that a standard normal `z` stands for. l: the root of the covariance. */
static struct nav_pose gaussian_at(const struct nav_gaussian *g, const double l[9], const double z[3])
{
    return (struct nav_pose){g->mean.x + l[0] * z[0], g->mean.y + l[3] * z[0] + l[4] * z[1],
                             nav_wrap(g->mean.theta + l[6] * z[0] + l[7] * z[1] + l[8] * z[2])};
}

enum { ACROSS = 25, TURNS = 7 }; /* points of the whitened lattice along an axis */

/* Headings are few: kernels half as wide as their spacing leave 1 % of a ripple. */
static const double TURN_KERNEL = 0.5;

/* Mass of each of `points` whitened lattice points, which reach to 3 standard deviations and have `variance`. */
static void gaussian_shares(int points, double variance, double *share)
{
    double total = 0.0, half = (points - 1) / 2.0;
    for (int k = 0; k < points; k++) {
        share[k] = exp(-4.5 / variance * (k - half) * (k - half) / (half * half));
        total += share[k];
    }
    for (int k = 0; k < points; k++)
        share[k] /= total;
}

long nav_gaussian_components(const struct nav_gaussian *g, struct nav_component *out, long room)
{
    enum { ALL = ACROSS * ACROSS * TURNS };
    double l[9], share[ACROSS], share_turn[TURNS], spacing = 6.0 / (ACROSS - 1), spacing_turn = 6.0 / (TURNS - 1);
    gaussian_root(g->covariance, l);
    gaussian_shares(ACROSS, 1.0, share);
    gaussian_shares(TURNS, 1.0 - TURN_KERNEL * TURN_KERNEL * spacing_turn * spacing_turn, share_turn);
    for (int n = 0; n < ALL && n < room; n++) {
        int i = n / TURNS / ACROSS, j = n / TURNS % ACROSS, k = n % TURNS;
        const double z[3] = {spacing * (i - ACROSS / 2), spacing * (j - ACROSS / 2), spacing_turn * (k - TURNS / 2)};
        out[n] = (struct nav_component){
            .pose = gaussian_at(g, l, z),
            .sigma_m = spacing / sqrt(12.0) * fmax(hypot(l[0], l[3]), l[4]), /* no gaps along the long axis */
            .sigma_rad = TURN_KERNEL * spacing_turn * l[8],
            .mass = share[i] * share[j] * share_turn[k],
        };
    }
    return ALL;
}

void nav_gaussian_move(struct nav_gaussian *g, struct nav_pose step, const struct nav_noise *noise)
{
    struct nav_pose to = nav_compose(g->mean, step);
    /* J = [1 0 a; 0 1 b; 0 0 1]: how an error in heading moves the end point. */
    double a = -(to.y - g->mean.y), b = to.x - g->mean.x;
    double *p = g->covariance;
    double xt = p[3 * X + T], yt = p[3 * Y + T], tt = p[3 * T + T];
    p[3 * X + X] += 2.0 * a * xt + a * a * tt + noise->position;
    p[3 * Y + Y] += 2.0 * b * yt + b * b * tt + noise->position;
    p[3 * X + Y] += a * yt + b * xt + a * b * tt;
    p[3 * X + T] += a * tt;
    p[3 * Y + T] += b * tt;
    p[3 * T + T] += noise->heading;
    p[3 * Y + X] = p[3 * X + Y];
    p[3 * T + X] = p[3 * X + T];
    p[3 * T + Y] = p[3 * Y + T];
    g->mean = (struct nav_pose){to.x, to.y, nav_wrap(to.theta)};
}

bool nav_gaussian_invert(const double c[9], double out[9])
{
    double xx = c[4] * c[8] - c[5] * c[5], xy = c[2] * c[5] - c[1] * c[8], xt = c[1] * c[5] - c[2] * c[4];
    double yy = c[0] * c[8] - c[2] * c[2], yt = c[1] * c[2] - c[0] * c[5], tt = c[0] * c[4] - c[1] * c[1];
    double determinant = c[0] * xx + c[1] * xy + c[2] * xt;
    if (!(c[0] > 0.0 && tt > 0.0 && determinant > 0.0 && isfinite(determinant)))
        return false;
    const double adjoint[9] = {xx, xy, xt, xy, yy, yt, xt, yt, tt};
    for (int i = 0; i < 9; i++)
        out[i] = adjoint[i] / determinant;
    return true;
}

/* Mass of a normal distribution within `half` a width of an angle `off` from its mean, all turns taken together. */
static double gaussian_turned(double off, double half, double sigma)
{
    double root = fmax(sigma, 1e-9) * sqrt(2.0), sum = 0.0;
    if (fabs(off) + NAV_COMPONENT_REACH * sigma < half)
        return 1.0;
    if (sigma > NAV_PI) /* as good as even: its first harmonic is 1 % */
        return half / NAV_PI;
    for (int turn = -1; turn <= 1; turn++) {
        double centre = nav_wrap(off) + 2.0 * NAV_PI * turn;
        sum += 0.5 * (erf((centre + half) / root) - erf((centre - half) / root));
    }
    return sum;
}

/* Mass of a round normal distribution within NAV_NEAR_M of a point. Narrow: the circle's edge is nearly straight. Wide:
 * the non-central chi-squared distribution of two degrees of freedom, a Poisson mixture of central ones. */
static double gaussian_within(double square, double sigma)
{
    double far = sqrt(square), share = 0.5 * square / (sigma * sigma), sum = 0.0;
    if (fabs(far - NAV_NEAR_M) > NAV_COMPONENT_REACH * sigma)
        return far < NAV_NEAR_M ? 1.0 : 0.0;
    if (sigma < NAV_NEAR_M / 8.0) /* within 0.001 */
        return 0.5 * erfc((sqrt(square + sigma * sigma) - NAV_NEAR_M) / (sigma * sqrt(2.0)));
    double edge = 0.5 * NAV_NEAR_M * NAV_NEAR_M / (sigma * sigma), poisson = exp(-share), term = exp(-edge);
    double within = 1.0 - term;
    for (int j = 1; within > 1e-4; j++) {
        sum += poisson * within;
        poisson *= share / j;
        term *= edge / j;
        within -= term;
    }
    return sum;
}

double nav_component_near(double square, double turn, double sigma_m, double sigma_rad)
{
    double within = gaussian_within(square, sigma_m);
    return within > 0.0 ? within * gaussian_turned(turn, NAV_NEAR_RAD, sigma_rad) : 0.0;
}

/* Points of a midpoint rule. */
enum { POINTS = 16 };

/* Mass within `radius` of the origin of a normal about (x, y) with covariance xx, xy, yy: along its long axis by
 * points, across by the error function. */
static double gaussian_disc(double x, double y, double xx, double xy, double yy, double radius)
{
    double turned = 0.5 * atan2(2.0 * xy, xx - yy), c = cos(turned), s = sin(turned), sum = 0.0;
    double along = sqrt(fmax(c * c * xx + 2.0 * c * s * xy + s * s * yy, 1e-18));
    double across = sqrt(fmax(s * s * xx - 2.0 * c * s * xy + c * c * yy, 1e-18)) * sqrt(2.0);
    double u = c * x + s * y, v = c * y - s * x;
    double low = fmax(-radius, u - NAV_COMPONENT_REACH * along), high = fmin(radius, u + NAV_COMPONENT_REACH * along);
    if (!(low < high))
        return 0.0;
    double first = asin(low / radius), step = (asin(high / radius) - first) / POINTS;
    for (int n = 0; n < POINTS; n++) {
        double at = radius * sin(first + (n + 0.5) * step), half = radius * cos(first + (n + 0.5) * step);
        double z = (at - u) / along;
        sum += half * exp(-0.5 * z * z) * (erf((half - v) / across) + erf((half + v) / across));
    }
    return sum * step / (along * sqrt(8.0 * NAV_PI));
}

/* Headings by points: each has the positions that go with it. */
double nav_gaussian_mass(const struct nav_gaussian *g, double radius, double angle)
{
    const double *p = g->covariance, sigma = sqrt(fmax(p[8], 1e-18));
    if (NAV_COMPONENT_REACH * sqrt(p[0] + p[4]) < radius &&
        NAV_COMPONENT_REACH * sigma < angle) /* all but 3e-4 of it */
        return 1.0;
    if (sigma > NAV_PI) /* all headings are as likely, wherever they lead */
        return gaussian_disc(0.0, 0.0, p[0], p[1], p[4], radius) * angle / NAV_PI;
    double sum = 0.0, a = p[2] / sigma, b = p[5] / sigma;
    for (int turn = -1; turn <= 1; turn++) {
        double low = fmax((2.0 * NAV_PI * turn - angle) / sigma, -NAV_COMPONENT_REACH);
        double step = (fmin((2.0 * NAV_PI * turn + angle) / sigma, NAV_COMPONENT_REACH) - low) / POINTS;
        for (int n = 0; n < POINTS && step > 0.0; n++) {
            double z = low + (n + 0.5) * step,
                   mass = erf((z + step / 2.0) / sqrt(2.0)) - erf((z - step / 2.0) / sqrt(2.0));
            sum += 0.5 * mass * gaussian_disc(a * z, b * z, p[0] - a * a, p[1] - a * b, p[4] - b * b, radius);
        }
    }
    return fmin(sum, 1.0);
}
