#include "lattice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Blurring costs a pass over all cells, so variance is saved up to this share of a squared cell edge ... */
static const double OWED_LEAST = 0.04;
/* ... and no pass of the three-point kernel takes more than this (its centre weight stays above 1/2). */
static const double PASS_MOST = 0.5;

int nav_lattice_init(struct nav_lattice *l, double size_x, double size_y, double cell, int headings)
{
    *l = (struct nav_lattice){.nx = (int)ceil(size_x / cell - 1e-6),
                              .ny = (int)ceil(size_y / cell - 1e-6),
                              .nh = headings,
                              .cell = cell,
                              .cell_theta = 2.0 * NAV_PI / headings};
    l->shift_x = calloc((size_t)headings, sizeof *l->shift_x);
    l->shift_y = calloc((size_t)headings, sizeof *l->shift_y);
    l->mass = calloc(nav_lattice_cells(l), sizeof *l->mass);
    l->scratch = calloc(nav_lattice_cells(l), sizeof *l->scratch);
    return l->shift_x && l->shift_y && l->mass && l->scratch ? 0 : -1;
}

void nav_lattice_free(struct nav_lattice *l)
{
    free(l->shift_x);
    free(l->shift_y);
    free(l->mass);
    free(l->scratch);
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
    return (slice + 0.5) * l->cell_theta + l->rotation;
}

float *nav_lattice_slice(const struct nav_lattice *l, int slice)
{
    return l->mass + (size_t)slice * slice_cells(l);
}

static int clip(int value, int low, int high)
{
    return value < low ? low : value > high ? high : value;
}

/* Moves a slice's content by whole cells; what enters is empty. */
static void roll(const struct nav_lattice *l, float *slice, int dx, int dy)
{
    if (dx == 0 && dy == 0)
        return;
    int from = clip(-dx, 0, l->nx), to = clip(l->nx - dx, 0, l->nx);
    memcpy(l->scratch, slice, slice_cells(l) * sizeof *slice);
    memset(slice, 0, slice_cells(l) * sizeof *slice);
    for (int y = clip(-dy, 0, l->ny); y < clip(l->ny - dy, 0, l->ny) && from < to; y++)
        memcpy(slice + (y + dy) * l->nx + from + dx, l->scratch + y * l->nx + from,
               (size_t)(to - from) * sizeof *slice);
}

static int carry(double *shift, double by, double cell, int most)
{
    double whole = floor((*shift + by) / cell + 0.5);
    *shift += by - whole * cell;
    return (int)fmax(fmin(whole, most), -most);
}

/* A three-point kernel with weight `side` on each side, along cells `stride` apart. */
static void blur_axis(const float *in, float *out, int n, size_t stride, float side)
{
    float centre = 1.0f - 2.0f * side;
    for (int i = 0; i < n; i++) {
        float before = i > 0 ? in[(size_t)(i - 1) * stride] : 0.0f;
        float after = i + 1 < n ? in[(size_t)(i + 1) * stride] : 0.0f;
        out[(size_t)i * stride] = centre * in[(size_t)i * stride] + side * (before + after);
    }
}

static void add_rows(float *out, const float *row, const float *before, const float *after, int n, float side)
{
    float centre = 1.0f - 2.0f * side;
    for (int i = 0; i < n; i++)
        out[i] = centre * row[i] + side * ((before ? before[i] : 0.0f) + (after ? after[i] : 0.0f));
}

static void blur_slice(const struct nav_lattice *l, float *slice, float side)
{
    for (int y = 0; y < l->ny; y++)
        blur_axis(slice + y * l->nx, l->scratch + y * l->nx, l->nx, 1, side);
    for (int y = 0; y < l->ny; y++) {
        const float *row = l->scratch + y * l->nx;
        add_rows(slice + y * l->nx, row, y > 0 ? row - l->nx : NULL, y + 1 < l->ny ? row + l->nx : NULL, l->nx, side);
    }
}

static void blur_position(struct nav_lattice *l, double share)
{
    for (int p = 0; p < l->nh; p++)
        blur_slice(l, nav_lattice_slice(l, p), (float)(share / 2.0));
}

/* Adds `side` times one slice to another whose shift differs: split between the cells it falls on, so that the mean is
 * kept. to, from: slice numbers. */
static void pour(const struct nav_lattice *l, float *out, int to, int from, float side)
{
    const float *in = nav_lattice_slice(l, from);
    double x = (l->shift_x[from] - l->shift_x[to]) / l->cell, y = (l->shift_y[from] - l->shift_y[to]) / l->cell;
    int dx = (int)floor(x), dy = (int)floor(y);
    for (int corner = 0; corner < 4; corner++) {
        int sx = dx + corner % 2, sy = dy + corner / 2;
        double fx = corner % 2 ? x - dx : 1.0 - (x - dx), fy = corner / 2 ? y - dy : 1.0 - (y - dy);
        float weight = side * (float)(fx * fy);
        int from_x = clip(-sx, 0, l->nx), to_x = clip(l->nx - sx, 0, l->nx);
        for (int j = clip(-sy, 0, l->ny); j < clip(l->ny - sy, 0, l->ny); j++) {
            float *target = out + (j + sy) * l->nx + sx;
            const float *source = in + j * l->nx;
            for (int i = from_x; i < to_x; i++)
                target[i] += weight * source[i];
        }
    }
}

static void blur_heading(struct nav_lattice *l, double share)
{
    float side = (float)(share / 2.0), centre = 1.0f - 2.0f * side;
    for (int p = 0; p < l->nh; p++) {
        float *out = l->scratch + (size_t)p * slice_cells(l);
        const float *in = nav_lattice_slice(l, p);
        for (size_t i = 0; i < slice_cells(l); i++)
            out[i] = centre * in[i];
        pour(l, out, p, (p + 1) % l->nh, side);
        pour(l, out, p, (p + l->nh - 1) % l->nh, side);
    }
    float *blurred = l->scratch;
    l->scratch = l->mass;
    l->mass = blurred;
}

/* Pays owed variance in passes; a pass with side weight s adds 2 s cell^2, that is `share` of a squared cell edge. */
static void pay(struct nav_lattice *l, double *owed, double cell, void (*blur)(struct nav_lattice *, double))
{
    double share = fmin(*owed / (cell * cell), 100.0);
    if (share < OWED_LEAST)
        return;
    int passes = (int)ceil(share / PASS_MOST);
    for (int i = 0; i < passes; i++)
        blur(l, share / passes);
    *owed = 0.0;
}

void nav_lattice_move(struct nav_lattice *l, struct nav_pose step, const struct nav_noise *noise)
{
    for (int p = 0; p < l->nh; p++) {
        double c = cos(nav_lattice_heading(l, p)), s = sin(nav_lattice_heading(l, p));
        int dx = carry(&l->shift_x[p], c * step.x - s * step.y, l->cell, l->nx);
        int dy = carry(&l->shift_y[p], s * step.x + c * step.y, l->cell, l->ny);
        roll(l, nav_lattice_slice(l, p), dx, dy);
    }
    l->rotation = nav_wrap(l->rotation + step.theta);
    l->owed_position += noise->position;
    l->owed_heading += noise->heading;
    pay(l, &l->owed_position, l->cell, blur_position);
    pay(l, &l->owed_heading, l->cell_theta, blur_heading);
}
