#include "mixture.h"

#include <math.h>

static const double REACH = 6.0; /* standard deviations beyond which a component holds nothing */

bool nav_mixture_given(const struct nav_prior *prior)
{
    return !prior->uniform && prior->components > 0;
}

void nav_mixture_normalise(struct nav_component *component, long count)
{
    double total = 0.0;
    for (long n = 0; n < count; n++)
        total += component[n].mass;
    for (long n = 0; n < count; n++)
        component[n].mass /= total;
}

static struct nav_pose mixture_mean_of(const struct nav_prior *prior)
{
    double x = 0.0, y = 0.0, c = 0.0, s = 0.0;
    for (long n = 0; n < prior->components; n++) {
        const struct nav_component *b = &prior->component[n];
        x += b->mass * b->pose.x;
        y += b->mass * b->pose.y;
        c += b->mass * cos(b->pose.theta);
        s += b->mass * sin(b->pose.theta);
    }
    return (struct nav_pose){x, y, atan2(s, c)};
}

struct nav_gaussian nav_mixture_gaussian(const struct nav_prior *prior)
{
    struct nav_gaussian g = {.mean = mixture_mean_of(prior)};
    for (long n = 0; n < prior->components; n++) {
        const struct nav_component *b = &prior->component[n];
        const double d[3] = {b->pose.x - g.mean.x, b->pose.y - g.mean.y, nav_wrap(b->pose.theta - g.mean.theta)};
        for (int k = 0; k < 9; k++)
            g.covariance[k] += b->mass * d[k / 3] * d[k % 3];
        g.covariance[0] += b->mass * b->sigma_m * b->sigma_m;
        g.covariance[4] += b->mass * b->sigma_m * b->sigma_m;
        g.covariance[8] += b->mass * b->sigma_rad * b->sigma_rad;
    }
    return g;
}

struct nav_gaussian nav_mixture_prior(const struct nav_problem *problem)
{
    const struct nav_prior *prior = &problem->prior;
    if (nav_mixture_given(prior))
        return nav_mixture_gaussian(prior);
    if (prior->uniform)
        return nav_gaussian_uniform(&problem->arena);
    struct nav_gaussian g = {.mean = prior->mean};
    for (int i = 0; i < 3; i++)
        g.covariance[4 * i] = prior->sigma[i] * prior->sigma[i];
    return g;
}

struct nav_pose nav_mixture_draw(const struct nav_prior *prior, struct nav_rng *rng)
{
    double mark = nav_rng_uniform(rng);
    long n = 0;
    while (n + 1 < prior->components && (mark -= prior->component[n].mass) >= 0.0)
        n++;
    const struct nav_component *b = &prior->component[n];
    struct nav_pose pose = {b->pose.x + b->sigma_m * nav_rng_normal(rng), b->pose.y + b->sigma_m * nav_rng_normal(rng),
                            0.0};
    pose.theta = nav_wrap(b->pose.theta + b->sigma_rad * nav_rng_normal(rng));
    return pose;
}

double nav_normal_between(double low, double high, double mean, double sigma)
{
    double root = sigma * sqrt(2.0);
    return 0.5 * (erf((high - mean) / root) - erf((low - mean) / root));
}

/* Share of a heading's normal distribution within `half` a width on both sides of an angle `off` from the mean. */
static double mixture_heading_within(double off, double half, double sigma)
{
    double sum = 0.0;
    for (int turn = -1; turn <= 1; turn++) {
        double centre = nav_wrap(off) + 2.0 * NAV_PI * turn;
        sum += nav_normal_between(centre - half, centre + half, 0.0, sigma);
    }
    return sum;
}

/* Cells of a line that a component reaches: *first .. the number returned, less 1. */
static int mixture_reached(double at, double sigma, double cell, int count, int *first)
{
    *first = (int)fmax(floor((at - REACH * sigma) / cell), 0.0);
    return (int)fmin(floor((at + REACH * sigma) / cell) + 1.0, count);
}

/* Independent normal distributions over x, y and heading. */
struct normal {
    struct nav_pose mean;
    double sigma[3], mass;
};

/* Adds a slice's share `heading` of one; `column` has room for a line. */
static void mixture_add_slice(const struct normal *b, const struct nav_shape *s, double heading, float *column,
                              float *slice)
{
    int left, low, right = mixture_reached(b->mean.x, b->sigma[0], s->cell, s->nx, &left);
    int high = mixture_reached(b->mean.y, b->sigma[1], s->cell, s->ny, &low);
    for (int i = left; i < right; i++)
        column[i] = (float)nav_normal_between(i * s->cell, (i + 1) * s->cell, b->mean.x, b->sigma[0]);
    for (int j = low; j < high; j++) {
        double share = nav_normal_between(j * s->cell, (j + 1) * s->cell, b->mean.y, b->sigma[1]);
        float *cell = slice + (size_t)j * (size_t)s->groups * NAV_LANES, row = (float)(heading * b->mass * share);
        for (int i = left; i < right; i++)
            cell[i] += row * column[i];
    }
}

static void mixture_add_normal(const struct normal *b, const struct nav_shape *s, float *column, float *mass)
{
    for (int p = 0; p < s->nh; p++) {
        double off = (p + 0.5) * s->cell_theta - b->mean.theta;
        double heading = mixture_heading_within(off, s->cell_theta / 2.0, b->sigma[2]);
        if (heading > 0.0)
            mixture_add_slice(b, s, heading, column, mass + (size_t)p * (size_t)s->ny * (size_t)s->groups * NAV_LANES);
    }
}

static void mixture_add_everywhere(const struct nav_shape *s, float *mass)
{
    float each = (float)(NAV_ANYWHERE / ((double)s->nh * s->ny * s->nx));
    size_t pitch = (size_t)s->groups * NAV_LANES;
    for (size_t n = 0; n < nav_shape_cells(s); n++)
        mass[n] = n % pitch < (size_t)s->nx ? each : 0.0f;
}

static void mixture_add_component(const struct nav_component *c, const struct nav_shape *s, float *column, float *mass)
{
    const struct normal b = {c->pose, {c->sigma_m, c->sigma_m, c->sigma_rad}, (1.0 - NAV_ANYWHERE) * c->mass};
    mixture_add_normal(&b, s, column, mass);
}

void nav_mixture_fill(const struct nav_prior *prior, struct nav_histogram *h)
{
    const struct normal one = {prior->mean, {prior->sigma[0], prior->sigma[1], prior->sigma[2]}, 1.0};
    float *column, *mass = nav_histogram_write_out(h, &column);
    if (nav_mixture_given(prior))
        mixture_add_everywhere(&h->shape, mass);
    else
        mixture_add_normal(&one, &h->shape, column, mass);
    for (long n = 0; nav_mixture_given(prior) && n < prior->components; n++)
        mixture_add_component(&prior->component[n], &h->shape, column, mass);
    nav_histogram_take(h);
}
