/* What a lattice's belief amounts to: prior in, mode, mean near it, covariance out. */
#include <math.h>
#include <string.h>

#include "lattice.h"

static double normal_between(double low, double high, double mean, double sigma)
{
    double root = sigma * sqrt(2.0);
    return 0.5 * (erf((high - mean) / root) - erf((low - mean) / root));
}

/* Mass of a cell along one axis; headings wrap. */
static double heading_mass(const struct nav_lattice *l, const struct nav_prior *prior, int slice)
{
    double off = nav_wrap(nav_lattice_heading(l, slice) - prior->mean.theta), half = l->cell_theta / 2.0, sum = 0.0;
    for (int turn = -1; turn <= 1; turn++) {
        double centre = off + 2.0 * NAV_PI * turn;
        sum += normal_between(centre - half, centre + half, 0.0, prior->sigma[2]);
    }
    return sum;
}

void nav_lattice_fill(struct nav_lattice *l, const struct nav_prior *prior)
{
    for (int p = 0; p < l->nh; p++) {
        float *cell = nav_lattice_slice(l, p);
        double heading = prior->uniform ? 1.0 : heading_mass(l, prior, p);
        for (int j = 0; j < l->ny; j++) {
            double y = j * l->cell;
            double row = prior->uniform ? 1.0 : normal_between(y, y + l->cell, prior->mean.y, prior->sigma[1]);
            for (int i = 0; i < l->nx; i++) {
                double x = i * l->cell;
                double column = prior->uniform ? 1.0 : normal_between(x, x + l->cell, prior->mean.x, prior->sigma[0]);
                *cell++ = (float)(heading * row * column);
            }
        }
    }
}

struct nav_pose nav_lattice_centre(const struct nav_lattice *l, size_t index)
{
    size_t nx = (size_t)l->nx, ny = (size_t)l->ny;
    int p = (int)(index / (nx * ny)), j = (int)(index / nx % ny), i = (int)(index % nx);
    return (struct nav_pose){(i + 0.5) * l->cell + l->shift_x[p], (j + 0.5) * l->cell + l->shift_y[p],
                             nav_wrap(nav_lattice_heading(l, p))};
}

size_t nav_lattice_peak(const struct nav_lattice *l, int slice)
{
    size_t cells = (size_t)l->nx * (size_t)l->ny, best = 0;
    const float *mass = nav_lattice_slice(l, slice);
    for (size_t i = 1; i < cells; i++) {
        if (mass[i] > mass[best])
            best = i;
    }
    return (size_t)slice * cells + best;
}

struct sums {
    double mass, x, y, theta; /* offsets from the pose, times mass */
};

static void near_in_slice(const struct nav_lattice *l, int p, struct nav_pose pose, double turn, struct sums *s)
{
    double x0 = 0.5 * l->cell + l->shift_x[p] - pose.x, y0 = 0.5 * l->cell + l->shift_y[p] - pose.y;
    int first_j = (int)fmax(ceil((-NAV_NEAR_M - y0) / l->cell), 0.0);
    int first_i = (int)fmax(ceil((-NAV_NEAR_M - x0) / l->cell), 0.0);
    for (int j = first_j; j < l->ny && y0 + j * l->cell <= NAV_NEAR_M; j++) {
        const float *row = nav_lattice_slice(l, p) + j * l->nx;
        double y = y0 + j * l->cell;
        for (int i = first_i; i < l->nx && x0 + i * l->cell <= NAV_NEAR_M; i++) {
            double x = x0 + i * l->cell, mass = row[i];
            if (x * x + y * y > NAV_NEAR_M * NAV_NEAR_M)
                continue;
            s->mass += mass;
            s->x += mass * x;
            s->y += mass * y;
            s->theta += mass * turn;
        }
    }
}

double nav_lattice_near(const struct nav_lattice *l, struct nav_pose pose, struct nav_pose *mean)
{
    struct sums s = {.mass = 0.0};
    for (int p = 0; p < l->nh; p++) {
        double turn = nav_wrap(nav_lattice_heading(l, p) - pose.theta);
        if (fabs(turn) <= NAV_NEAR_RAD)
            near_in_slice(l, p, pose, turn, &s);
    }
    if (mean && s.mass > 0.0)
        *mean =
            (struct nav_pose){pose.x + s.x / s.mass, pose.y + s.y / s.mass, nav_wrap(pose.theta + s.theta / s.mass)};
    return s.mass * l->scale;
}

/* Adds one slice's moments about (x, y) to sums xx, xy, yy, xt, yt, tt, its heading being off by `turn`. */
static void add_slice(const double m[NAV_MOMENTS], double x, double y, double turn, double sums[6])
{
    double mx = m[1] - x * m[0], my = m[2] - y * m[0];
    sums[0] += m[3] - 2.0 * x * m[1] + x * x * m[0];
    sums[1] += m[4] - x * m[2] - y * m[1] + x * y * m[0];
    sums[2] += m[5] - 2.0 * y * m[2] + y * y * m[0];
    sums[3] += mx * turn;
    sums[4] += my * turn;
    sums[5] += m[0] * turn * turn;
}

void nav_lattice_covariance(const struct nav_lattice *l, struct nav_pose about, double covariance[9])
{
    double sums[6] = {0.0};
    for (int p = 0; p < l->nh; p++)
        add_slice(l->moment[p], about.x - l->moment_x, about.y - l->moment_y,
                  nav_wrap(nav_lattice_heading(l, p) - about.theta), sums);
    for (int k = 0; k < 6; k++)
        sums[k] /= l->total;
    double within = l->cell * l->cell / 12.0, within_theta = l->cell_theta * l->cell_theta / 12.0;
    double xx = fmax(sums[0], 0.0) + within, yy = fmax(sums[2], 0.0) + within;
    const double all[9] = {xx, sums[1], sums[3], sums[1], yy, sums[4], sums[3], sums[4], sums[5] + within_theta};
    memcpy(covariance, all, sizeof all);
}
