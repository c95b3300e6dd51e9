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

void nav_gaussian_ahead(const struct nav_gaussian *g, const struct nav_pending *pending, struct nav_estimate *estimate)
{
    struct nav_gaussian now = *g;
    nav_gaussian_move(&now, pending->step, &pending->noise);
    estimate->pose = now.mean;
    memcpy(estimate->covariance, now.covariance, sizeof now.covariance);
}

void nav_gaussian_root(const double p[9], double root[9])
{
    double a = sqrt(fmax(p[0], 1e-18)), b = p[3] / a, d = p[6] / a;
    double c = sqrt(fmax(p[4] - b * b, 1e-18)), e = (p[7] - d * b) / c;
    const double out[9] = {a, 0.0, 0.0, b, c, 0.0, d, e, sqrt(fmax(p[8] - d * d - e * e, 1e-18))};
    memcpy(root, out, sizeof out);
}

struct nav_pose nav_gaussian_at(const struct nav_gaussian *g, const double l[9], const double z[3])
{
    return (struct nav_pose){g->mean.x + l[0] * z[0], g->mean.y + l[3] * z[0] + l[4] * z[1],
                             nav_wrap(g->mean.theta + l[6] * z[0] + l[7] * z[1] + l[8] * z[2])};
}

enum { ACROSS = 25, TURNS = 7 }; /* points of the whitened lattice along an axis */

/* Mass of each of `points` whitened lattice points, which reach to 3 standard deviations. */
static void gaussian_shares(int points, double *share)
{
    double total = 0.0, half = (points - 1) / 2.0;
    for (int k = 0; k < points; k++) {
        share[k] = exp(-4.5 * (k - half) * (k - half) / (half * half));
        total += share[k];
    }
    for (int k = 0; k < points; k++)
        share[k] /= total;
}

long nav_gaussian_components(const struct nav_gaussian *g, struct nav_component *out, long room)
{
    enum { ALL = ACROSS * ACROSS * TURNS };
    double l[9], share[ACROSS], share_turn[TURNS], spacing = 6.0 / (ACROSS - 1), spacing_turn = 6.0 / (TURNS - 1);
    nav_gaussian_root(g->covariance, l);
    gaussian_shares(ACROSS, share);
    gaussian_shares(TURNS, share_turn);
    for (int n = 0; n < ALL && n < room; n++) {
        int i = n / TURNS / ACROSS, j = n / TURNS % ACROSS, k = n % TURNS;
        const double z[3] = {spacing * (i - ACROSS / 2), spacing * (j - ACROSS / 2), spacing_turn * (k - TURNS / 2)};
        out[n] = (struct nav_component){
            .pose = nav_gaussian_at(g, l, z),
            .sigma_m = spacing / sqrt(12.0) * fmax(hypot(l[0], l[3]), l[4]), /* no gaps along the long axis */
            .sigma_rad = spacing_turn / sqrt(12.0) * l[8],
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

double nav_gaussian_mass(const struct nav_gaussian *g, double radius, double angle)
{
    enum { DIRECTIONS = 32 };
    const double *p = g->covariance, turned = erf(angle / sqrt(2.0 * fmax(p[8], 1e-18)));
    if (radius * radius > 50.0 * (p[0] + p[4])) /* less than e^-25 is farther off, whatever the direction */
        return turned;
    double root[9], mass = 0.0;
    nav_gaussian_root(p, root);
    /* A standard normal in polar coordinates: along each direction the whitened radius is Rayleigh distributed. */
    for (int i = 0; i < DIRECTIONS; i++) {
        double u = cos(NAV_PI * i / DIRECTIONS), v = sin(NAV_PI * i / DIRECTIONS);
        double stretch = hypot(root[0] * u, root[3] * u + root[4] * v);
        mass += -expm1(-0.5 * radius * radius / (stretch * stretch)) / DIRECTIONS;
    }
    return mass * turned;
}
