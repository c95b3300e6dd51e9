/* Part of a job: a slice's cells moved by its heading and blurred by the motion's noise. */
#include <math.h>
#include <string.h>

#include "adaptive_global_parts.h"

static bool empty(const struct adaptive_global *g, int p)
{
    int cells = 0;
    for (int j = 0; j < g->ny; j++)
        cells += adaptive_span_length(adaptive_spans(g, g->span, p)[j]);
    return cells == 0;
}

/* Where a slice's cells will be after whole-cell moves, and what its blurs will spread them over; returns the cells of
 * that. */
static long plan(struct adaptive_global *g, int p, int dx, int dy)
{
    const struct adaptive_span none = {0, 0}, *span = adaptive_spans(g, g->span, p);
    int reach = g->job.passes;
    long cells = 0;
    for (int j = 0; j < g->ny; j++)
        g->moved[j] = j - dy < 0 || j - dy >= g->ny ? none : adaptive_span_shifted(g, span[j - dy], dx, reach);
    for (int j = 0; j < g->ny; j++) {
        g->region[j] = g->moved[j];
        for (int k = j - reach; k <= j + reach; k++)
            g->region[j] = k < 0 || k >= g->ny ? g->region[j] : adaptive_span_join(g->region[j], g->moved[k]);
        cells += adaptive_span_length(g->region[j]);
    }
    return cells;
}

/* Moves a slice into the first plane; what leaves the arena is lost. */
static void lift(struct adaptive_global *g, int p, int dx, int dy)
{
    struct adaptive_span *span = adaptive_spans(g, g->span, p);
    for (int j = 0; j < g->ny; j++) {
        struct adaptive_span s = span[j];
        float *in = adaptive_global_line(g, g->mass, p, j);
        int begin = s.begin + dx > 0 ? s.begin : -dx, end = s.end + dx < g->nx ? s.end : g->nx - dx;
        if (j + dy >= 0 && j + dy < g->ny && begin < end)
            memcpy(adaptive_plane_line(g, 0, j + dy) + begin + dx, in + begin, (size_t)(end - begin) * sizeof *in);
        memset(in + s.begin, 0, (size_t)adaptive_span_length(s) * sizeof *in);
        span[j] = (struct adaptive_span){0, 0};
    }
}

static void blur_along(struct adaptive_global *g)
{
    for (int j = 0; j < g->ny; j++)
        nav_rows_best()->blur(adaptive_plane_line(g, 0, j), g->job.side, g->region[j].begin, g->region[j].end,
                              adaptive_plane_line(g, 1, j));
}

static void blur_across(struct adaptive_global *g)
{
    float side = g->job.side, centre = 1.0f - 2.0f * side;
    for (int j = 0; j < g->ny; j++) {
        const float *above = adaptive_plane_line(g, 1, j - 1), *at = adaptive_plane_line(g, 1, j),
                    *below = adaptive_plane_line(g, 1, j + 1);
        float *out = adaptive_plane_line(g, 0, j);
        for (int i = g->region[j].begin; i < g->region[j].end; i++)
            out[i] = centre * at[i] + side * (above[i] + below[i]);
    }
}

/* Empties both planes again. */
static void clear_planes(struct adaptive_global *g)
{
    for (int j = 0; j < g->ny; j++) {
        size_t bytes = (size_t)adaptive_span_length(g->region[j]) * sizeof(float);
        memset(adaptive_plane_line(g, 0, j) + g->region[j].begin, 0, bytes);
        if (g->job.passes)
            memset(adaptive_plane_line(g, 1, j) + g->region[j].begin, 0, bytes);
    }
}

/* A slice of the uniform belief stays uniform when it moves: what would enter is as likely as what leaves. */
static void fill(struct adaptive_global *g)
{
    float each = (float)(1.0 / (double)adaptive_global_cells(g));
    for (int j = 0; j < g->ny; j++) {
        float *out = adaptive_plane_line(g, 0, j);
        for (int i = 0; i < g->nx; i++)
            out[i] = each;
        g->region[j] = (struct adaptive_span){0, g->pitch};
    }
    g->job.passes = 0;
}

long adaptive_global_move(struct adaptive_global *g, int p, long most)
{
    double heading = adaptive_global_heading(g, p), c = cos(heading), s = sin(heading);
    double x = g->shift_x[p], y = g->shift_y[p];
    int dx = nav_slice_carry(&x, c * g->job.step.x - s * g->job.step.y, g->cell, g->nx);
    int dy = nav_slice_carry(&y, s * g->job.step.x + c * g->job.step.y, g->cell, g->ny);
    bool none = !g->fresh && empty(g, p);
    long cells = g->fresh ? (long)g->ny * g->pitch
                 : none   ? 0
                          : plan(g, p, dx, dy),
         touched = (2 + g->job.passes) * cells;
    if (touched > most)
        return -1;
    g->shift_x[p] = x;
    g->shift_y[p] = y;
    memset(g->moment[p], 0, sizeof g->moment[p]);
    if (none)
        return 0;
    if (g->fresh)
        fill(g);
    else
        lift(g, p, dx, dy);
    for (int pass = 0; pass < g->job.passes; pass++) {
        blur_along(g);
        if (pass + 1 < g->job.passes) /* the last is part of weighing */
            blur_across(g);
    }
    adaptive_global_weigh(g, p);
    clear_planes(g);
    return touched;
}
