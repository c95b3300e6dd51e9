/* What a lattice's belief amounts to: prior in, mode, mean near it, covariance out. */
#include <math.h>

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

double nav_lattice_near(const struct nav_lattice *l, struct nav_pose pose, struct nav_pose *mean)
{
    struct nav_near sums = {.mass = 0.0};
    for (int p = 0; p < l->nh; p++) {
        const struct nav_slice slice = {.mass = nav_lattice_slice(l, p),
                                        .nx = l->nx,
                                        .ny = l->ny,
                                        .pitch = l->nx,
                                        .cell = l->cell,
                                        .x = 0.5 * l->cell + l->shift_x[p],
                                        .y = 0.5 * l->cell + l->shift_y[p],
                                        .heading = nav_lattice_heading(l, p)};
        nav_slice_near(&slice, pose, &sums);
    }
    if (mean && sums.mass > 0.0)
        *mean = nav_near_mean(&sums, pose);
    return sums.mass * l->scale;
}

void nav_lattice_covariance(const struct nav_lattice *l, struct nav_pose about, double covariance[9])
{
    double sums[6] = {0.0};
    for (int p = 0; p < l->nh; p++)
        nav_slice_add(l->moment[p], about.x - l->moment_x, about.y - l->moment_y,
                      nav_wrap(nav_lattice_heading(l, p) - about.theta), sums);
    nav_slice_covariance(sums, l->total, l->cell, l->cell_theta, covariance);
}
