/* A lattice's belief: a prior in, its mode and sums out. */
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

struct nav_slices nav_lattice_slices(const struct nav_lattice *l)
{
    return (struct nav_slices){.mass = l->mass,
                               .nx = l->nx,
                               .ny = l->ny,
                               .nh = l->nh,
                               .pitch = l->nx,
                               .cell = l->cell,
                               .cell_theta = l->cell_theta,
                               .rotation = l->rotation,
                               .shift_x = l->shift_x,
                               .shift_y = l->shift_y,
                               .moment = l->moment,
                               .moment_x = l->moment_x,
                               .moment_y = l->moment_y,
                               .total = l->total};
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
