/* What the arena-wide belief amounts to: its summary, the cells worth a hypothesis, and hypotheses drawn from it. */
#include <math.h>
#include <string.h>

#include "adaptive_global_parts.h"

struct nav_slices adaptive_global_slices(const struct adaptive_global *g)
{
    return (struct nav_slices){.mass = g->mass,
                               .nx = g->nx,
                               .ny = g->ny,
                               .nh = g->nh,
                               .pitch = g->pitch,
                               .cell = g->cell,
                               .cell_theta = g->cell_theta,
                               .rotation = g->rotation,
                               .shift_x = g->shift_x,
                               .shift_y = g->shift_y,
                               .moment = g->moment,
                               .moment_x = g->job.about.x,
                               .moment_y = g->job.about.y,
                               .total = g->total};
}

void adaptive_global_summarise(struct adaptive_global *g)
{
    const struct nav_slices slices = adaptive_global_slices(g);
    g->summary = (struct nav_summary){.near = 0.0};
    double near = nav_slices_summarise(&slices, nav_slices_centre(&slices, g->mode), &g->summary.belief);
    g->summary.near = fmin(near / g->total, 1.0);
}

static void count_line(struct adaptive_global *g, const float *cell, struct adaptive_span s)
{
    float worth = (float)g->job.worth, light[NAV_LANES] = {0.0f}, crowd[NAV_LANES] = {0.0f};
    for (int i = s.begin; i < s.end; i += NAV_LANES) {
        for (int k = 0; k < NAV_LANES; k++) {
            float mass = cell[i + k];
            light[k] += mass < worth ? mass : 0.0f;
            crowd[k] += mass < worth ? 0.0f : 1.0f;
        }
    }
    for (int k = 0; k < NAV_LANES; k++) {
        g->job.light += (double)light[k];
        g->job.crowd += (double)crowd[k];
    }
}

long adaptive_global_count(struct adaptive_global *g, int p, long most)
{
    const struct adaptive_span *span = adaptive_spans(g, g->span, p);
    long cells = 0;
    for (int j = 0; j < g->ny; j++)
        cells += adaptive_span_length(span[j]);
    if (cells > most)
        return -1;
    for (int j = 0; j < g->ny; j++)
        count_line(g, adaptive_global_line(g, g->mass, p, j), span[j]);
    return cells;
}

/* Adds a cell's mass to the mode that it is nearest to. */
static void share_cell(const struct nav_mode *mode, int modes, struct nav_pose at, double mass, double *share)
{
    double least = NAV_MODE_REACH;
    int nearest = -1;
    for (int m = 0; m < modes; m++) {
        double far = nav_mode_distance(mode[m].mean, at);
        if (far > least)
            continue;
        least = far;
        nearest = m;
    }
    if (nearest >= 0)
        share[nearest] += mass;
}

void adaptive_global_share(const struct adaptive_global *g, const struct nav_mode *mode, int modes, double *share)
{
    memset(share, 0, (size_t)modes * sizeof *share);
    for (int p = 0; p < g->nh; p++) {
        const struct adaptive_span *span = adaptive_spans(g, g->span, p);
        struct nav_pose at = {.theta = adaptive_global_heading(g, p)};
        for (int j = 0; j < g->ny; j++) {
            const float *cell = adaptive_global_line(g, g->mass, p, j);
            at.y = (j + 0.5) * g->cell + g->shift_y[p];
            for (int i = span[j].begin; i < span[j].end; i++) {
                at.x = (i + 0.5) * g->cell + g->shift_x[p];
                if (cell[i] > 0.0f)
                    share_cell(mode, modes, at, (double)cell[i] / g->total, share);
            }
        }
    }
}

void adaptive_global_add(struct adaptive_global *g, struct nav_pose pose, double share)
{
    double turns = (pose.theta - g->rotation) / (2.0 * NAV_PI), mass = share * g->total;
    int p = (int)((turns - floor(turns)) * g->nh) % g->nh;
    int i = (int)floor((pose.x - g->shift_x[p]) / g->cell), j = (int)floor((pose.y - g->shift_y[p]) / g->cell);
    if (i < 0 || j < 0 || i >= g->nx || j >= g->ny)
        return;
    struct adaptive_span *span = adaptive_spans(g, g->span, p) + j;
    adaptive_global_line(g, g->mass, p, j)[i] += (float)mass;
    *span = adaptive_span_join(*span, adaptive_span_of(g, i, i + 1));
}

static struct nav_pose within_cell(const struct adaptive_global *g, struct nav_pose centre, struct nav_rng *rng)
{
    return (struct nav_pose){centre.x + g->cell * (nav_rng_uniform(rng) - 0.5),
                             centre.y + g->cell * (nav_rng_uniform(rng) - 0.5),
                             centre.theta + g->cell_theta * (nav_rng_uniform(rng) - 0.5)};
}

void adaptive_global_draw(struct adaptive_global *g, struct nav_particles *to, struct nav_rng *rng, long count,
                          double weight, struct nav_pose moved)
{
    double step = g->total / (double)count, mark = step * nav_rng_uniform(rng), sum = 0.0;
    const struct nav_slices slices = adaptive_global_slices(g);
    for (size_t n = 0; n < adaptive_global_stored(g); n++) {
        size_t line = n / (size_t)g->pitch;
        if (n % (size_t)g->pitch == 0 && g->span[line].begin == g->span[line].end) {
            n += (size_t)g->pitch - 1;
            continue;
        }
        sum += (double)g->mass[n];
        if (mark >= sum)
            continue;
        struct nav_pose centre = nav_slices_centre(&slices, n);
        for (; mark < sum; mark += step)
            nav_particles_add(to, nav_compose(within_cell(g, centre, rng), moved), weight / (double)count, rng);
    }
}
