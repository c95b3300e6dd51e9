/* A lattice's belief: a prior in, its mode and sums out. */
#include "bumps.h"
#include "lattice.h"

static double heading_mass(const struct nav_lattice *l, const struct nav_prior *prior, int slice)
{
    return nav_heading_within(nav_lattice_heading(l, slice) - prior->mean.theta, l->cell_theta / 2.0, prior->sigma[2]);
}

void nav_lattice_fill(struct nav_lattice *l, const struct nav_prior *prior)
{
    if (nav_bumps_given(prior)) {
        const struct nav_slices slices = nav_lattice_slices(l);
        nav_bumps_fill(prior, &slices, l->mass);
        return;
    }
    for (int p = 0; p < l->nh; p++) {
        float *cell = nav_lattice_slice(l, p);
        double heading = prior->uniform ? 1.0 : heading_mass(l, prior, p);
        for (int j = 0; j < l->ny; j++) {
            double y = j * l->cell;
            double row = prior->uniform ? 1.0 : nav_normal_between(y, y + l->cell, prior->mean.y, prior->sigma[1]);
            for (int i = 0; i < l->nx; i++) {
                double x = i * l->cell;
                double column =
                    prior->uniform ? 1.0 : nav_normal_between(x, x + l->cell, prior->mean.x, prior->sigma[0]);
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
