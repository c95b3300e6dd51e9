/* Part of a job: headings blurred, each slice with its two neighbours. */
#include <math.h>
#include <string.h>

#include "adaptive_global_parts.h"

/* A neighbouring slice, at the nearest cells of another's shift. */
struct pour {
    int slice, dx, dy;
};

static struct pour pour_from(const struct adaptive_global *g, int to, int from)
{
    return (struct pour){from, (int)floor((g->shift_x[from] - g->shift_x[to]) / g->cell + 0.5),
                         (int)floor((g->shift_y[from] - g->shift_y[to]) / g->cell + 0.5)};
}

/* Span of what falls on line j. */
static struct adaptive_span poured(const struct adaptive_global *g, const struct pour *pour, int j)
{
    j -= pour->dy;
    if (j < 0 || j >= g->ny)
        return (struct adaptive_span){0, 0};
    return adaptive_span_shifted(g, adaptive_spans(g, g->span, pour->slice)[j], pour->dx, 0);
}

/* Adds `weight` of what falls on cells of line j. */
static void pour_line(const struct adaptive_global *g, const struct pour *pour, int j, float weight, float *out)
{
    if (j - pour->dy < 0 || j - pour->dy >= g->ny)
        return;
    struct adaptive_span s = adaptive_spans(g, g->span, pour->slice)[j - pour->dy];
    const float *in = adaptive_global_line(g, g->mass, pour->slice, j - pour->dy) - pour->dx;
    int begin = s.begin + pour->dx > 0 ? s.begin + pour->dx : 0;
    int end = s.end + pour->dx < g->nx ? s.end + pour->dx : g->nx;
    for (int i = begin; i < end; i++)
        out[i] += weight * in[i];
}

long adaptive_global_turn(struct adaptive_global *g, int p, long most)
{
    float side = g->job.side_heading;
    const float weight[3] = {1.0f - 2.0f * side, side, side};
    const struct pour from[3] = {{p, 0, 0}, pour_from(g, p, (p + g->nh - 1) % g->nh), pour_from(g, p, (p + 1) % g->nh)};
    struct adaptive_span *span = adaptive_spans(g, g->span_turned, p);
    long cells = 0;
    for (int j = 0; j < g->ny; j++) {
        span[j] = adaptive_span_join(adaptive_span_join(poured(g, &from[0], j), poured(g, &from[1], j)),
                                     poured(g, &from[2], j));
        cells += 3 * (long)adaptive_span_length(span[j]);
    }
    if (cells > most)
        return -1;
    memset(adaptive_global_line(g, g->turned, p, 0), 0, (size_t)(g->ny * g->pitch) * sizeof *g->turned);
    for (int j = 0; j < g->ny; j++) {
        for (int k = 0; k < 3 && adaptive_span_length(span[j]); k++)
            pour_line(g, &from[k], j, weight[k], adaptive_global_line(g, g->turned, p, j));
    }
    return cells;
}

void adaptive_global_turned(struct adaptive_global *g)
{
    float *mass = g->mass;
    struct adaptive_span *span = g->span;
    g->mass = g->turned;
    g->span = g->span_turned;
    g->turned = mass;
    g->span_turned = span;
}
