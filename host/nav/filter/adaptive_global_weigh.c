/* Part of a job: a slice's cells multiplied by the likelihood of the job's rows, worked out when the first cell with
 * mass asks for it. */
#include <math.h>
#include <string.h>

#include "adaptive_global_parts.h"

/* A cell with less than this share of all mass is dropped. A uniform belief has 1e-5 in each of its cells. */
static const float SHARE_LEAST = 1e-8f;

void adaptive_global_forget_values(struct adaptive_global *g)
{
    for (uint32_t n = 0; n < g->knowns; n++)
        g->value[g->known[n]] = -1.0f;
    g->knowns = 0;
}

/* Works out a signature's likelihood for the present job. */
static float value_of(struct adaptive_global *g, uint32_t signature)
{
    g->distinct++;
    g->known[g->knowns++] = signature;
    return g->value[signature] = (float)nav_expected_one(g->expected, signature);
}

static bool any(const float mass[NAV_LANES])
{
    uint32_t bits[NAV_LANES], all = 0;
    memcpy(bits, mass, sizeof bits);
    for (int k = 0; k < NAV_LANES; k++)
        all |= bits[k];
    return all << 1 != 0; /* but for a sign */
}

/* Looks up a line's likelihoods where there is mass, and lists the cells whose likelihood is still to be worked out:
 * its sign tells. Without branches from cell to cell: which these are, nobody can predict. */
static int look_up(const struct adaptive_global *g, const uint32_t *signature, const float *mass, float *like,
                   struct adaptive_span s)
{
    const float *value = g->value;
    int *missing = g->missing, count = 0;
    for (int first = s.begin; first < s.end; first += NAV_LANES) {
        if (!any(mass + first))
            continue;
        for (int i = first; i < first + NAV_LANES; i++) {
            uint32_t bits, held;
            memcpy(&bits, &value[signature[i]], sizeof bits);
            memcpy(&like[i], &bits, sizeof bits);
            memcpy(&held, &mass[i], sizeof held);
            missing[count] = i;
            count += (int)(bits >> 31) & (held != 0);
        }
    }
    return count;
}

static void complete(struct adaptive_global *g, const uint32_t *signature, float *like, int count)
{
    for (int n = 0; n < count; n++) {
        int i = g->missing[n];
        float known = g->value[signature[i]]; /* an earlier cell of the line may have asked for it */
        like[i] = known < 0.0f ? value_of(g, signature[i]) : known;
    }
}

/* First row of signatures of a slice's phase, at the heading after the job's motion. */
static const uint32_t *signatures(const struct adaptive_global *g, int p)
{
    double heading = (adaptive_global_heading(g, p) + g->job.step.theta) / (2.0 * NAV_PI);
    int k = (int)((heading - floor(heading)) * g->expected->nh) % g->expected->nh;
    int x = (int)floor(0.5 * ADAPTIVE_SUB + g->shift_x[p] / g->expected->step);
    int y = (int)floor(0.5 * ADAPTIVE_SUB + g->shift_y[p] / g->expected->step);
    size_t layer = ((size_t)k * ADAPTIVE_SUB + (size_t)(y % ADAPTIVE_SUB)) * ADAPTIVE_SUB + (size_t)(x % ADAPTIVE_SUB);
    size_t row = layer * ((size_t)g->ny + 1) + (size_t)(y / ADAPTIVE_SUB);
    return g->signature + row * adaptive_signature_pitch(g) + x / ADAPTIVE_SUB;
}

/* What is left of a span without its empty ends. */
static struct adaptive_span tighten(const float *cell, struct adaptive_span s)
{
    while (s.begin < s.end && !any(cell + s.begin))
        s.begin += NAV_LANES;
    while (s.begin < s.end && !any(cell + s.end - NAV_LANES))
        s.end -= NAV_LANES;
    return adaptive_span_length(s) ? s : (struct adaptive_span){0, 0};
}

static void note(struct adaptive_global *g, int p, const struct nav_row_sums *sums)
{
    nav_slice_moments(sums, g->moment[p]);
    g->job.total += g->moment[p][0];
    for (int k = 0; k < NAV_LANES; k++) {
        if (sums->peak[k] > g->job.heaviest) {
            g->job.heaviest = sums->peak[k];
            g->job.mode_slice = p;
        }
    }
}

/* Line j of the likelihoods. */
static float *likelihoods(const struct adaptive_global *g, int j)
{
    return g->like + (size_t)j * (size_t)g->pitch;
}

/* Takes what the planes hold into the belief, light cells left out, and looks up what is to be multiplied. */
static void drop(struct adaptive_global *g, int p)
{
    float side = g->job.passes ? g->job.side : 0.0f, scale = g->job.scale;
    struct nav_row_weigh w = {.centre = scale * (1.0f - 2.0f * side), .side = scale * side, .least = SHARE_LEAST};
    const uint32_t *signature = signatures(g, p);
    int plane = g->job.passes > 0;
    for (int j = 0; j < g->ny; j++, signature += adaptive_signature_pitch(g)) {
        struct adaptive_span s = g->region[j];
        if (adaptive_span_length(s) == 0)
            continue;
        w.above = adaptive_plane_line(g, plane, j - 1);
        w.at = adaptive_plane_line(g, plane, j);
        w.below = adaptive_plane_line(g, plane, j + 1);
        w.begin = s.begin;
        w.end = s.end;
        w.out = adaptive_global_line(g, g->mass, p, j);
        nav_rows_best()->thin(&w);
        complete(g, signature, likelihoods(g, j), look_up(g, signature, w.out, likelihoods(g, j), s));
    }
}

/* Multiplies. Where there is no mass, likelihoods that nobody asked for do no harm. */
static void multiply(struct adaptive_global *g, int p)
{
    double x = 0.5 * g->cell + g->shift_x[p], y = 0.5 * g->cell + g->shift_y[p];
    struct adaptive_span *span = adaptive_spans(g, g->span, p);
    struct nav_row_sums sums = {.peak = {0.0f}};
    struct nav_row_weigh w = {.coordinate = g->coordinate, .centre = 1.0f};
    nav_slice_coordinates(x - g->job.about.x, g->cell, g->pitch, g->coordinate);
    for (int j = 0; j < g->ny; j++) {
        w.at = w.above = w.below = w.out = adaptive_global_line(g, g->mass, p, j);
        w.like = likelihoods(g, j);
        w.y = (float)(y + j * g->cell - g->job.about.y);
        w.begin = g->region[j].begin;
        w.end = g->region[j].end;
        nav_rows_best()->weigh(&w, &sums);
        span[j] = tighten(w.out, g->region[j]);
    }
    note(g, p, &sums);
}

void adaptive_global_weigh(struct adaptive_global *g, int p)
{
    drop(g, p);
    multiply(g, p);
}
