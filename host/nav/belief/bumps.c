#include "bumps.h"

#include <math.h>

static const double REACH = 6.0; /* standard deviations beyond which a bump holds nothing */

bool nav_bumps_given(const struct nav_prior *prior)
{
    return !prior->uniform && prior->bumps > 0;
}

void nav_bumps_normalise(struct nav_component *bump, long count)
{
    double total = 0.0;
    for (long n = 0; n < count; n++)
        total += bump[n].mass;
    for (long n = 0; n < count; n++)
        bump[n].mass /= total;
}

static struct nav_pose mean_of(const struct nav_prior *prior)
{
    double x = 0.0, y = 0.0, c = 0.0, s = 0.0;
    for (long n = 0; n < prior->bumps; n++) {
        const struct nav_component *b = &prior->bump[n];
        x += b->mass * b->pose.x;
        y += b->mass * b->pose.y;
        c += b->mass * cos(b->pose.theta);
        s += b->mass * sin(b->pose.theta);
    }
    return (struct nav_pose){x, y, atan2(s, c)};
}

struct nav_gaussian nav_bumps_gaussian(const struct nav_prior *prior)
{
    struct nav_gaussian g = {.mean = mean_of(prior)};
    for (long n = 0; n < prior->bumps; n++) {
        const struct nav_component *b = &prior->bump[n];
        const double d[3] = {b->pose.x - g.mean.x, b->pose.y - g.mean.y, nav_wrap(b->pose.theta - g.mean.theta)};
        for (int k = 0; k < 9; k++)
            g.covariance[k] += b->mass * d[k / 3] * d[k % 3];
        g.covariance[0] += b->mass * b->sigma_m * b->sigma_m;
        g.covariance[4] += b->mass * b->sigma_m * b->sigma_m;
        g.covariance[8] += b->mass * b->sigma_rad * b->sigma_rad;
    }
    return g;
}

struct nav_pose nav_bumps_draw(const struct nav_prior *prior, struct nav_rng *rng)
{
    double mark = nav_rng_uniform(rng);
    long n = 0;
    while (n + 1 < prior->bumps && (mark -= prior->bump[n].mass) >= 0.0)
        n++;
    const struct nav_component *b = &prior->bump[n];
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

double nav_heading_within(double off, double half, double sigma)
{
    double sum = 0.0;
    for (int turn = -1; turn <= 1; turn++) {
        double centre = nav_wrap(off) + 2.0 * NAV_PI * turn;
        sum += nav_normal_between(centre - half, centre + half, 0.0, sigma);
    }
    return sum;
}

/* Cells of a line that a bump reaches: *first .. the number returned, less 1. */
static int reached(double at, double sigma, double cell, int count, int *first)
{
    *first = (int)fmax(floor((at - REACH * sigma) / cell), 0.0);
    return (int)fmin(ceil((at + REACH * sigma) / cell), count);
}

/* A bump's shares of some columns, and where they begin; wide bumps take several of these. */
struct columns {
    int first, count;
    float share[64];
};

/* Adds some columns of a bump to a slice, which has the share `heading` of it. */
static void add_columns(const struct nav_component *b, const struct nav_slices *at, const struct columns *columns,
                        double heading, float *slice)
{
    int first, end = reached(b->pose.y, b->sigma_m, at->cell, at->ny, &first);
    for (int j = first; j < end; j++) {
        double low = j * at->cell;
        float row = (float)(heading * nav_normal_between(low, low + at->cell, b->pose.y, b->sigma_m));
        float *cell = slice + (size_t)j * (size_t)at->pitch + columns->first;
        for (int i = 0; i < columns->count; i++)
            cell[i] += row * columns->share[i];
    }
}

static void add_bump(const struct nav_component *b, const struct nav_slices *at, float *mass)
{
    enum { ROOM = sizeof((struct columns *)0)->share / sizeof(float) };
    struct columns columns;
    int end = reached(b->pose.x, b->sigma_m, at->cell, at->nx, &columns.first);
    for (; columns.first < end; columns.first += columns.count) {
        columns.count = end - columns.first < ROOM ? end - columns.first : ROOM;
        for (int i = 0; i < columns.count; i++) {
            double low = (columns.first + i) * at->cell;
            columns.share[i] = (float)nav_normal_between(low, low + at->cell, b->pose.x, b->sigma_m);
        }
        for (int p = 0; p < at->nh; p++) {
            double off = nav_slice_heading(p, at->cell_theta, at->rotation) - b->pose.theta;
            double heading = nav_heading_within(off, at->cell_theta / 2.0, b->sigma_rad);
            if (heading > 0.0)
                add_columns(b, at, &columns, (1.0 - NAV_ANYWHERE) * b->mass * heading,
                            mass + (size_t)p * (size_t)at->ny * (size_t)at->pitch);
        }
    }
}

void nav_bumps_fill(const struct nav_prior *prior, const struct nav_slices *at, float *mass)
{
    float everywhere = (float)(NAV_ANYWHERE / ((double)at->nh * at->ny * at->nx));
    for (size_t n = 0; n < (size_t)at->nh * (size_t)at->ny * (size_t)at->pitch; n++)
        mass[n] = n % (size_t)at->pitch < (size_t)at->nx ? everywhere : 0.0f;
    for (long n = 0; n < prior->bumps; n++)
        add_bump(&prior->bump[n], at, mass);
}
