/* One slice of a job: moved by its heading, blurred by the motion's noise, weighed by the rows' factors. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "adaptive_global.h"

/* A cell with less than this share of all mass is dropped. A uniform belief has 1e-5 in each of its cells. */
static const float SHARE_LEAST = 1e-8f;

int adaptive_global_lines(const struct adaptive_global *g, int p)
{
    int count = 0;
    for (int j = 0; j < g->ny; j++)
        count += g->live[p * g->ny + j];
    return count;
}

static float *line(const struct adaptive_global *g, float *mass, int p, int j)
{
    return mass + ((size_t)p * (size_t)g->ny + (size_t)j) * (size_t)g->nx;
}

/* Adds `side` of slice `from` to slice `to` in scratch, at the nearest cells of its other shift. */
static void pour(struct adaptive_global *g, int to, int from, float side)
{
    int dx = (int)floor((g->shift_x[from] - g->shift_x[to]) / g->cell + 0.5);
    int dy = (int)floor((g->shift_y[from] - g->shift_y[to]) / g->cell + 0.5);
    int first = dx > 0 ? 0 : -dx, last = dx > 0 ? g->nx - dx : g->nx;
    for (int j = 0; j < g->ny; j++) {
        if (!g->live[from * g->ny + j] || j + dy < 0 || j + dy >= g->ny)
            continue;
        const float *in = line(g, g->mass, from, j);
        float *out = line(g, g->scratch, to, j + dy) + dx;
        for (int i = first; i < last; i++)
            out[i] += side * in[i];
    }
}

void adaptive_global_turn(struct adaptive_global *g, int p)
{
    float side = g->job.side_heading, centre = 1.0f - 2.0f * side;
    int before = (p + g->nh - 1) % g->nh, after = (p + 1) % g->nh;
    for (int j = 0; j < g->ny; j++) {
        const float *in = line(g, g->mass, p, j);
        float *out = line(g, g->scratch, p, j);
        for (int i = 0; i < g->nx; i++)
            out[i] = centre * in[i];
    }
    pour(g, p, before, side);
    pour(g, p, after, side);
    g->touched += 3 * (long)adaptive_global_plane(g);
}

void adaptive_global_turned(struct adaptive_global *g)
{
    float *blurred = g->scratch;
    g->scratch = g->mass;
    g->mass = blurred;
    g->job.turning = false;
    g->job.slice = 0;
    memset(g->live, 1, (size_t)g->nh * (size_t)g->ny); /* which lines gained mass, the next pass finds out */
}

static int carry(double *shift, double by, double cell, int most)
{
    double whole = floor((*shift + by) / cell + 0.5);
    *shift += by - whole * cell;
    return (int)fmax(fmin(whole, most), -most);
}

/* Moves a slice by whole cells; what enters is empty. */
static void roll(struct adaptive_global *g, int p, int dx, int dy)
{
    if (dx == 0 && dy == 0)
        return;
    float *slice = line(g, g->mass, p, 0);
    size_t bytes = (size_t)g->nx * sizeof *slice;
    memcpy(g->scratch, slice, adaptive_global_plane(g) * sizeof *slice);
    uint8_t *live = g->live + p * g->ny, *was = (uint8_t *)(g->scratch + adaptive_global_plane(g));
    memcpy(was, live, (size_t)g->ny);
    for (int j = 0; j < g->ny; j++) {
        int from = j - dy;
        live[j] = from >= 0 && from < g->ny && was[from];
        float *out = slice + (size_t)j * (size_t)g->nx;
        memset(out, 0, bytes);
        if (live[j] && abs(dx) < g->nx) {
            const float *in = g->scratch + (size_t)from * (size_t)g->nx;
            memcpy(out + (dx > 0 ? dx : 0), in + (dx > 0 ? 0 : -dx), bytes - (size_t)abs(dx) * sizeof *out);
        }
    }
}

static void blur_line(const float *in, float *out, int n, float side)
{
    float centre = 1.0f - 2.0f * side;
    for (int i = 1; i + 1 < n; i++)
        out[i] = centre * in[i] + side * (in[i - 1] + in[i + 1]);
    out[0] = centre * in[0] + (n > 1 ? side * in[1] : 0.0f);
    if (n > 1)
        out[n - 1] = centre * in[n - 1] + side * in[n - 2];
}

/* One pass of a three-point blur along x and y. */
static void blur_slice(struct adaptive_global *g, int p, float side)
{
    uint8_t *live = g->live + p * g->ny, *was = (uint8_t *)(g->scratch + adaptive_global_plane(g));
    memcpy(was, live, (size_t)g->ny);
    for (int j = 0; j < g->ny; j++) {
        if (was[j])
            blur_line(line(g, g->mass, p, j), g->scratch + j * g->nx, g->nx, side);
        else
            memset(g->scratch + j * g->nx, 0, (size_t)g->nx * sizeof *g->scratch);
    }
    for (int j = 0; j < g->ny; j++) {
        bool below = j > 0 && was[j - 1], above = j + 1 < g->ny && was[j + 1];
        live[j] = was[j] || below || above;
        if (!live[j])
            continue;
        const float *row = g->scratch + j * g->nx, *low = below ? row - g->nx : row, *high = above ? row + g->nx : row;
        float a = below ? side : 0.0f, b = above ? side : 0.0f, centre = 1.0f - 2.0f * side;
        float *out = line(g, g->mass, p, j);
        for (int i = 0; i < g->nx; i++)
            out[i] = centre * row[i] + a * low[i] + b * high[i];
    }
}

/* Works out a signature's likelihood for the present job. */
static float value_of(struct adaptive_global *g, uint32_t signature)
{
    const uint8_t *codes = g->expected->codes + signature * ((size_t)g->expected->whiskers + 1);
    float product = signature ? 1.0f : 0.0f;
    for (int w = 0; signature && w < g->expected->whiskers; w++)
        product *= g->factor[w][codes[w]];
    g->distinct++;
    g->value[signature] = (struct adaptive_value){g->jobs, product};
    return product;
}

/* Power of two of a mass up to 1, as an index: 0 for 1/2 .. 1. */
static int size_of(float mass)
{
    uint32_t bits;
    memcpy(&bits, &mass, sizeof bits);
    int size = 126 - (int)(bits >> 23);
    return size < 0 ? 0 : size < ADAPTIVE_SIZES ? size : ADAPTIVE_SIZES - 1;
}

/* Counts a line's cells by the size of their mass. */
static void count_line(struct adaptive_global *g, const float *cell)
{
    for (int i = 0; i < g->nx; i++)
        g->job.many[size_of(cell[i])]++;
}

/* Weighs one line of cells; returns its mass. */
static double weigh_line(struct adaptive_global *g, float *cell, const uint32_t *signature)
{
    float scale = g->job.scale, heaviest = g->job.heaviest, total = 0.0f;
    const struct adaptive_value *value = g->value;
    uint32_t jobs = g->jobs;
    int n = g->nx, mode = -1;
    for (int i = 0; i < n; i++) {
        float before = cell[i] * scale;
        if (!(before > SHARE_LEAST)) {
            cell[i] = 0.0f;
            continue;
        }
        uint32_t code = signature[i * ADAPTIVE_SUB];
        float mass = before * (value[code].job == jobs ? value[code].value : value_of(g, code));
        cell[i] = mass;
        total += mass;
        if (mass > heaviest) {
            heaviest = mass;
            mode = i;
        }
    }
    if (mode >= 0) {
        g->job.heaviest = heaviest;
        g->job.mode = (size_t)(cell + mode - g->mass);
    }
    return (double)total;
}

/* Adds a line's moments about the arena's corner to its slice's. */
static void add_moments(struct adaptive_global *g, int p, int j, const float *cell)
{
    float mass = 0.0f, first = 0.0f, second = 0.0f, x = (float)(0.5 * g->cell + g->shift_x[p]);
    for (int i = 0; i < g->nx; i++) {
        float at = x + (float)i * (float)g->cell, part = cell[i] * at;
        mass += cell[i];
        first += part;
        second += part * at;
    }
    double y = (j + 0.5) * g->cell + g->shift_y[p], *m = g->moment + 6 * p;
    const double add[6] = {(double)mass,   (double)first,     y * (double)mass,
                           (double)second, y * (double)first, y * y * (double)mass};
    for (int k = 0; k < 6; k++)
        m[k] += add[k];
}

static void weigh_slice(struct adaptive_global *g, int p)
{
    memset(g->moment + 6 * p, 0, 6 * sizeof *g->moment);
    double heading = ((p + 0.5) * g->cell_theta + g->rotation + g->job.step.theta) / (2.0 * NAV_PI);
    int k = (int)((heading - floor(heading)) * g->expected->nh) % g->expected->nh;
    int x = (int)floor(0.5 * ADAPTIVE_SUB + g->shift_x[p] / g->expected->step);
    double y = 0.5 * ADAPTIVE_SUB + g->shift_y[p] / g->expected->step;
    for (int j = 0; j < g->ny; j++) {
        if (!g->live[p * g->ny + j])
            continue;
        const uint32_t *signature = nav_expected_row(g->expected, k, (int)floor(y + j * ADAPTIVE_SUB)) + x;
        double mass = weigh_line(g, line(g, g->mass, p, j), signature);
        g->job.total += mass;
        g->live[p * g->ny + j] = mass > 0.0;
        if (!(mass > 0.0))
            continue;
        add_moments(g, p, j, line(g, g->mass, p, j));
        if (g->job.sized)
            count_line(g, line(g, g->mass, p, j));
    }
}

void adaptive_global_move(struct adaptive_global *g, int p)
{
    if (g->fresh) {
        float each = (float)(1.0 / (double)adaptive_global_cells(g));
        for (size_t i = 0; i < adaptive_global_plane(g); i++)
            line(g, g->mass, p, 0)[i] = each;
        memset(g->live + p * g->ny, 1, (size_t)g->ny);
    }
    double heading = (p + 0.5) * g->cell_theta + g->rotation, c = cos(heading), s = sin(heading);
    int dx = carry(&g->shift_x[p], c * g->job.step.x - s * g->job.step.y, g->cell, g->nx);
    int dy = carry(&g->shift_y[p], s * g->job.step.x + c * g->job.step.y, g->cell, g->ny);
    if (!g->fresh) { /* uniform stays uniform: what would enter is as likely as what leaves */
        roll(g, p, dx, dy);
        for (int pass = 0; pass < g->job.passes; pass++)
            blur_slice(g, p, g->job.side);
    }
    weigh_slice(g, p);
}
