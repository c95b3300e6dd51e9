#include "lattice.h"

#include <math.h>
#include <stdlib.h>

#include "lattice_pass.h"

int nav_lattice_init(struct nav_lattice *l, double size_x, double size_y, double cell, int headings)
{
    *l = (struct nav_lattice){.nx = (int)ceil(size_x / cell - 1e-6),
                              .ny = (int)ceil(size_y / cell - 1e-6),
                              .nh = headings,
                              .cell = cell,
                              .cell_theta = 2.0 * NAV_PI / headings,
                              .scale = 1.0};
    l->shift_x = calloc((size_t)headings, sizeof *l->shift_x);
    l->shift_y = calloc((size_t)headings, sizeof *l->shift_y);
    l->roll_x = calloc((size_t)headings, sizeof *l->roll_x);
    l->roll_y = calloc((size_t)headings, sizeof *l->roll_y);
    /* Rows are read in whole lanes, which may reach beyond the last cell. */
    l->mass = calloc(nav_lattice_cells(l) + NAV_LANES, sizeof *l->mass);
    l->spare = calloc(nav_lattice_cells(l) + NAV_LANES, sizeof *l->spare);
    l->rows = calloc(NAV_PASS_ROWS * nav_pass_pitch(l->nx), sizeof *l->rows);
    l->moment = calloc((size_t)headings, sizeof *l->moment);
    int shifts = l->shift_x && l->shift_y && l->roll_x && l->roll_y;
    return shifts && l->mass && l->spare && l->rows && l->moment ? 0 : -1;
}

void nav_lattice_free(struct nav_lattice *l)
{
    free(l->shift_x);
    free(l->shift_y);
    free(l->roll_x);
    free(l->roll_y);
    free(l->mass);
    free(l->spare);
    free(l->rows);
    free(l->moment);
}

static size_t slice_cells(const struct nav_lattice *l)
{
    return (size_t)l->nx * (size_t)l->ny;
}

size_t nav_lattice_cells(const struct nav_lattice *l)
{
    return slice_cells(l) * (size_t)l->nh;
}

double nav_lattice_heading(const struct nav_lattice *l, int slice)
{
    return nav_slice_heading(slice, l->cell_theta, l->rotation);
}

float *nav_lattice_slice(const struct nav_lattice *l, int slice)
{
    return l->mass + (size_t)slice * slice_cells(l);
}

static int clip(int value, int most)
{
    return value < -most ? -most : value > most ? most : value;
}

void nav_lattice_shift(struct nav_lattice *l, struct nav_pose step, const struct nav_noise *noise)
{
    for (int p = 0; p < l->nh; p++) {
        double c = cos(nav_lattice_heading(l, p)), s = sin(nav_lattice_heading(l, p));
        int dx = nav_slice_carry(&l->shift_x[p], c * step.x - s * step.y, l->cell, l->nx);
        int dy = nav_slice_carry(&l->shift_y[p], s * step.x + c * step.y, l->cell, l->ny);
        l->roll_x[p] = clip(l->roll_x[p] + dx, l->nx);
        l->roll_y[p] = clip(l->roll_y[p] + dy, l->ny);
    }
    l->rotation = nav_wrap(l->rotation + step.theta);
    l->owed_position += noise->position;
    l->owed_heading += noise->heading;
}

void nav_lattice_clip(struct nav_lattice *l, const int *begin, const int *end)
{
    for (size_t n = 0; n < nav_lattice_cells(l); n++) {
        int i = (int)(n % (size_t)l->nx), j = (int)(n / (size_t)l->nx % (size_t)l->ny);
        if (i < begin[j] || i >= end[j])
            l->mass[n] = 0.0f;
    }
}
