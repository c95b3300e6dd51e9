/* Parts of a job for one slice: headings blurred, cells moved by the slice's heading, blurred by the motion's noise and
 * weighed by the rows' factors, cells counted that are worth a hypothesis. */
#include <math.h>
#include <string.h>

#include "adaptive_global.h"

/* A cell with less than this share of all mass is dropped. A uniform belief has 1e-5 in each of its cells. */
static const float SHARE_LEAST = 1e-8f;

static int length(struct adaptive_span s)
{
    return s.end - s.begin;
}

/* Cells lo .. hi - 1 as a span of whole lanes within a line. */
static struct adaptive_span span_of(const struct adaptive_global *g, int lo, int hi)
{
    lo = lo > 0 ? lo : 0;
    hi = hi < g->nx ? hi : g->nx;
    if (lo >= hi)
        return (struct adaptive_span){0, 0};
    return (struct adaptive_span){lo / NAV_LANES * NAV_LANES, (hi + NAV_LANES - 1) / NAV_LANES * NAV_LANES};
}

static struct adaptive_span join(struct adaptive_span a, struct adaptive_span b)
{
    if (length(a) == 0 || length(b) == 0)
        return length(a) == 0 ? b : a;
    return (struct adaptive_span){a.begin < b.begin ? a.begin : b.begin, a.end > b.end ? a.end : b.end};
}

/* A line's span moved by dx and grown by `by` on both sides. */
static struct adaptive_span shifted(const struct adaptive_global *g, struct adaptive_span s, int dx, int by)
{
    return length(s) ? span_of(g, s.begin + dx - by, s.end + dx + by) : s;
}

static struct adaptive_span *spans(const struct adaptive_global *g, struct adaptive_span *of, int p)
{
    return of + (size_t)p * (size_t)g->ny;
}

void adaptive_global_job_init(struct adaptive_global *g)
{
    for (uint32_t n = 0; n < g->knowns; n++)
        g->value[g->known[n]] = -1.0f;
    g->knowns = 0;
}

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
    return shifted(g, spans(g, g->span, pour->slice)[j], pour->dx, 0);
}

/* Adds `weight` of what falls on cells of line j. */
static void pour_line(const struct adaptive_global *g, const struct pour *pour, int j, float weight, float *out)
{
    if (j - pour->dy < 0 || j - pour->dy >= g->ny)
        return;
    struct adaptive_span s = spans(g, g->span, pour->slice)[j - pour->dy];
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
    struct adaptive_span *span = spans(g, g->span_turned, p);
    long cells = 0;
    for (int j = 0; j < g->ny; j++) {
        span[j] = join(join(poured(g, &from[0], j), poured(g, &from[1], j)), poured(g, &from[2], j));
        cells += 3 * (long)length(span[j]);
    }
    if (cells > most)
        return -1;
    memset(adaptive_global_line(g, g->turned, p, 0), 0, (size_t)(g->ny * g->pitch) * sizeof *g->turned);
    for (int j = 0; j < g->ny; j++) {
        for (int k = 0; k < 3 && length(span[j]); k++)
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

/* Line j of a plane. Lines -1 and ny, and a few cells on both sides, are always empty. */
static float *plane_line(const struct adaptive_global *g, int plane, int j)
{
    return g->plane[plane] + (size_t)(j + 1) * (size_t)(g->pitch + 2 * NAV_LANES) + NAV_LANES;
}

static bool empty(const struct adaptive_global *g, int p)
{
    int cells = 0;
    for (int j = 0; j < g->ny; j++)
        cells += length(spans(g, g->span, p)[j]);
    return cells == 0;
}

/* Where a slice's cells will be after whole-cell moves, and what its blurs will spread them over; returns the cells of
 * that. */
static long plan(struct adaptive_global *g, int p, int dx, int dy)
{
    const struct adaptive_span none = {0, 0}, *span = spans(g, g->span, p);
    int reach = g->job.passes;
    long cells = 0;
    for (int j = 0; j < g->ny; j++)
        g->moved[j] = j - dy < 0 || j - dy >= g->ny ? none : shifted(g, span[j - dy], dx, reach);
    for (int j = 0; j < g->ny; j++) {
        g->region[j] = g->moved[j];
        for (int k = j - reach; k <= j + reach; k++)
            g->region[j] = k < 0 || k >= g->ny ? g->region[j] : join(g->region[j], g->moved[k]);
        cells += length(g->region[j]);
    }
    return cells;
}

/* Moves a slice into the first plane; what leaves the arena is lost. */
static void lift(struct adaptive_global *g, int p, int dx, int dy)
{
    struct adaptive_span *span = spans(g, g->span, p);
    for (int j = 0; j < g->ny; j++) {
        struct adaptive_span s = span[j];
        float *in = adaptive_global_line(g, g->mass, p, j);
        int begin = s.begin + dx > 0 ? s.begin : -dx, end = s.end + dx < g->nx ? s.end : g->nx - dx;
        if (j + dy >= 0 && j + dy < g->ny && begin < end)
            memcpy(plane_line(g, 0, j + dy) + begin + dx, in + begin, (size_t)(end - begin) * sizeof *in);
        memset(in + s.begin, 0, (size_t)length(s) * sizeof *in);
        span[j] = (struct adaptive_span){0, 0};
    }
}

static void blur_along(struct adaptive_global *g)
{
    for (int j = 0; j < g->ny; j++)
        nav_rows_best()->blur(plane_line(g, 0, j), g->job.side, g->region[j].begin, g->region[j].end,
                              plane_line(g, 1, j));
}

static void blur_across(struct adaptive_global *g)
{
    float side = g->job.side, centre = 1.0f - 2.0f * side;
    for (int j = 0; j < g->ny; j++) {
        const float *above = plane_line(g, 1, j - 1), *at = plane_line(g, 1, j), *below = plane_line(g, 1, j + 1);
        float *out = plane_line(g, 0, j);
        for (int i = g->region[j].begin; i < g->region[j].end; i++)
            out[i] = centre * at[i] + side * (above[i] + below[i]);
    }
}

/* Empties both planes again. */
static void clear_planes(struct adaptive_global *g)
{
    for (int j = 0; j < g->ny; j++) {
        size_t bytes = (size_t)length(g->region[j]) * sizeof(float);
        memset(plane_line(g, 0, j) + g->region[j].begin, 0, bytes);
        if (g->job.passes)
            memset(plane_line(g, 1, j) + g->region[j].begin, 0, bytes);
    }
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
    double heading = ((p + 0.5) * g->cell_theta + g->rotation + g->job.step.theta) / (2.0 * NAV_PI);
    int k = (int)((heading - floor(heading)) * g->expected->nh) % g->expected->nh;
    int x = (int)floor(0.5 * ADAPTIVE_SUB + g->shift_x[p] / g->expected->step);
    int y = (int)floor(0.5 * ADAPTIVE_SUB + g->shift_y[p] / g->expected->step);
    size_t layer = ((size_t)k * ADAPTIVE_SUB + (size_t)(y % ADAPTIVE_SUB)) * ADAPTIVE_SUB + (size_t)(x % ADAPTIVE_SUB);
    size_t row = layer * ((size_t)g->ny + 1) + (size_t)(y / ADAPTIVE_SUB);
    return g->signature + row * ((size_t)g->pitch + 1) + x / ADAPTIVE_SUB;
}

/* What is left of a span without its empty ends. */
static struct adaptive_span tighten(const float *cell, struct adaptive_span s)
{
    while (s.begin < s.end && !any(cell + s.begin))
        s.begin += NAV_LANES;
    while (s.begin < s.end && !any(cell + s.end - NAV_LANES))
        s.end -= NAV_LANES;
    return length(s) ? s : (struct adaptive_span){0, 0};
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
    for (int j = 0; j < g->ny; j++, signature += g->pitch + 1) {
        struct adaptive_span s = g->region[j];
        if (length(s) == 0)
            continue;
        w.above = plane_line(g, plane, j - 1);
        w.at = plane_line(g, plane, j);
        w.below = plane_line(g, plane, j + 1);
        w.begin = s.begin;
        w.end = s.end;
        w.out = adaptive_global_line(g, g->mass, p, j);
        nav_rows_best()->thin(&w);
        complete(g, signature, likelihoods(g, j), look_up(g, signature, w.out, likelihoods(g, j), s));
    }
}

/* Multiplies. Where there is no mass, likelihoods that nobody asked for do no harm. */
static void weigh(struct adaptive_global *g, int p)
{
    const struct nav_slice slice = adaptive_global_slice(g, p);
    struct adaptive_span *span = spans(g, g->span, p);
    struct nav_row_sums sums = {.peak = {0.0f}};
    struct nav_row_weigh w = {.coordinate = g->coordinate, .centre = 1.0f};
    nav_slice_coordinates(slice.x - g->job.about.x, g->cell, g->pitch, g->coordinate);
    for (int j = 0; j < g->ny; j++) {
        w.at = w.above = w.below = w.out = adaptive_global_line(g, g->mass, p, j);
        w.like = likelihoods(g, j);
        w.y = (float)(slice.y + j * g->cell - g->job.about.y);
        w.begin = g->region[j].begin;
        w.end = g->region[j].end;
        nav_rows_best()->weigh(&w, &sums);
        span[j] = tighten(w.out, g->region[j]);
    }
    note(g, p, &sums);
}

/* A slice of the uniform belief stays uniform when it moves: what would enter is as likely as what leaves. */
static void fill(struct adaptive_global *g)
{
    float each = (float)(1.0 / (double)adaptive_global_cells(g));
    for (int j = 0; j < g->ny; j++) {
        float *out = plane_line(g, 0, j);
        for (int i = 0; i < g->nx; i++)
            out[i] = each;
        g->region[j] = (struct adaptive_span){0, g->pitch};
    }
    g->job.passes = 0;
}

long adaptive_global_move(struct adaptive_global *g, int p, long most)
{
    double heading = (p + 0.5) * g->cell_theta + g->rotation, c = cos(heading), s = sin(heading);
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
    drop(g, p);
    weigh(g, p);
    clear_planes(g);
    return touched;
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
    const struct adaptive_span *span = spans(g, g->span, p);
    long cells = 0;
    for (int j = 0; j < g->ny; j++)
        cells += length(span[j]);
    if (cells > most)
        return -1;
    for (int j = 0; j < g->ny; j++)
        count_line(g, adaptive_global_line(g, g->mass, p, j), span[j]);
    return cells;
}
