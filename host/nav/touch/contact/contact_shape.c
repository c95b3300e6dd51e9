#include "contact_shape.h"

#include <math.h>
#include <stdbool.h>

#define REST_BINS 4      /* first bins that give a first rest; 3 to 6 % of a long trace */
#define STANDS_OUT 6.0   /* a contact's peak over the noise of the rest */
#define PUSH_FROM 0.10   /* of the peak: the push is looked at between these ... */
#define PUSH_TO 0.92     /* ... */
#define LATE_FROM 0.50   /* ... and its last part gives the peak */
#define ONSET_TO 0.70    /* ... its first part the onset */
#define DEPART 0.04      /* of the peak: what is so far below the push's line is no longer push */
#define AFTER_BINS 6     /* that fix the line after the push */
#define BENDS 0.3        /* share of the deflection from which on a channel bends */
#define AFTER_LEAST 0.35 /* of the peak */

/* A trace as deflections along its main direction. */
struct course {
    int n;
    double t[NAV_TRACE_BINS], turn[NAV_TRACE_BINS], reported[NAV_TRACE_BINS], p[NAV_TRACE_BINS];
    double top;
    int before, from, to; /* last bin below the push, first and last bin of it */
};

struct line {
    double t, p, slope; /* through (t, p) */
    int n;
};

static struct line shape_line_through(const double *t, const double *p, int from, int to)
{
    struct line fit = {.n = to - from + 1};
    for (int i = from; i <= to; i++) {
        fit.t += t[i];
        fit.p += p[i];
    }
    fit.t /= fit.n;
    fit.p /= fit.n;
    double tt = 0.0, tp = 0.0;
    for (int i = from; i <= to; i++) {
        tt += (t[i] - fit.t) * (t[i] - fit.t);
        tp += (t[i] - fit.t) * (p[i] - fit.p);
    }
    fit.slope = tt > 0.0 ? tp / tt : 0.0;
    return fit;
}

static double shape_line_at(const struct line *line, double t)
{
    return line->p + line->slope * (t - line->t);
}

/* Deflection of each bin, about the mean of the first ones, along the main direction: that of the sum of all
 * deflections, each weighted by its square. */
static void shape_lay_out(const struct nav_trace *trace, struct course *c, double *direction)
{
    double rest[NAV_TRACE_AXES] = {0}, sum[NAV_TRACE_AXES] = {0}, norm = 0.0;
    for (int i = 0; i < REST_BINS; i++)
        for (int a = 0; a < trace->axes; a++)
            rest[a] += trace->sum[i].at[a] * nav_trace_share(trace, i) / REST_BINS;
    for (int i = 0; i < c->n; i++) {
        double share = nav_trace_share(trace, i), square = 0.0, off[NAV_TRACE_AXES];
        for (int a = 0; a < trace->axes; a++) {
            off[a] = trace->sum[i].at[a] * share - rest[a];
            square += off[a] * off[a];
        }
        for (int a = 0; a < trace->axes; a++)
            sum[a] += square * off[a];
    }
    for (int a = 0; a < trace->axes; a++)
        norm += sum[a] * sum[a];
    norm = sqrt(norm);
    for (int a = 0; a < trace->axes; a++)
        direction[a] = norm > 0.0 ? sum[a] / norm : 0.0;
    for (int i = 0; i < c->n; i++) {
        double share = nav_trace_share(trace, i);
        c->t[i] = trace->sum[i].t_s * share;
        c->turn[i] = trace->sum[i].turn * share;
        c->reported[i] = trace->sum[i].reported * share;
        c->p[i] = 0.0;
        for (int a = 0; a < trace->axes; a++)
            c->p[i] += (trace->sum[i].at[a] * share - rest[a]) * direction[a];
    }
}

static void shape_find_top(struct course *c)
{
    c->top = 0.0;
    for (int i = 0; i < c->n; i++)
        c->top = fmax(c->top, c->p[i]);
}

/* The push: the bins on the way up to the first that is near the top. */
static void shape_find_push(struct course *c)
{
    c->to = 0;
    while (c->to < c->n - 1 && c->p[c->to] < PUSH_TO * c->top)
        c->to++;
    c->before = c->to;
    while (c->before >= 0 && c->p[c->before] > PUSH_FROM * c->top)
        c->before--;
    c->from = c->before + 1;
    if (c->to > c->from)
        c->to--;
}

/* Noise of a bin from second differences, to which a steady push adds nothing. */
static double shape_jitter(const struct course *c)
{
    double sum = 0.0;
    for (int i = 1; i < c->n - 1; i++)
        sum += fabs(c->p[i - 1] - 2.0 * c->p[i] + c->p[i + 1]);
    return sum / (c->n - 2) / 1.954; /* mean length of what has the standard deviation sqrt(6): sqrt(12/pi) */
}

/* Takes the mean before the push for the rest. Returns the RMS about it. */
static double shape_settle_rest(struct course *c)
{
    /* What the push takes to get that far is left out, and the bin in which the touch may be. */
    int last = c->before - 1 - (int)((c->to - c->from + 1) * PUSH_FROM / (PUSH_TO - PUSH_FROM));
    if (last < 2)
        return shape_jitter(c);
    double mean = 0.0, square = 0.0;
    for (int i = 0; i <= last; i++)
        mean += c->p[i];
    mean /= last + 1;
    for (int i = 0; i <= last; i++)
        square += (c->p[i] - mean) * (c->p[i] - mean);
    for (int i = 0; i < c->n; i++)
        c->p[i] -= mean;
    c->top -= mean;
    return sqrt(square / last);
}

static int shape_first_above(const struct course *c, double share)
{
    int i = c->from;
    while (i < c->to && c->p[i] < share * c->top)
        i++;
    return i;
}

/* Least-squares parabola over the push: its change of slope over its length as a share of the slope; RMS left over. */
static double shape_bow_of(const struct course *c, double *left_over)
{
    struct line line = shape_line_through(c->t, c->p, c->from, c->to);
    double half = (c->t[c->to] - c->t[c->from]) / 2.0, scale = 1.0 / half;
    double square_mean = 0.0, qq = 0.0, qp = 0.0, pp = 0.0;
    for (int i = c->from; i <= c->to; i++)
        square_mean += (c->t[i] - line.t) * (c->t[i] - line.t);
    square_mean *= scale * scale / line.n;
    for (int i = c->from; i <= c->to; i++) {
        double x = (c->t[i] - line.t) * scale, q = x * x - square_mean, p = c->p[i] - shape_line_at(&line, c->t[i]);
        qq += q * q;
        qp += q * p;
        pp += p * p;
    }
    double bend = qq > 0.0 ? qp / qq : 0.0;
    *left_over = sqrt(fmax(0.0, pp - bend * qp) / line.n);
    return fmax(-2.0, fmin(2.0, 4.0 * bend / (line.slope * half)));
}

/* Last bin that still lies on the push's line. */
static int shape_last_on(const struct course *c, const struct line *late, double noise)
{
    double slack = fmax(DEPART * c->top, 5.0 * noise);
    int i = c->to;
    while (i < c->n - 1 && c->p[i + 1] >= shape_line_at(late, c->t[i + 1]) - slack)
        i++;
    return i;
}

/* When the push stopped: where its line meets the line of what follows; the trace's end where nothing does. */
static double shape_stop_of(const struct course *c, const struct line *late, int last, double end_s)
{
    if (last >= c->n - 2)
        return last == c->n - 1 ? end_s : c->t[last];
    int from = last + 2, to = from - 1;
    while (to + 1 < c->n && to - from + 1 < AFTER_BINS && c->p[to + 1] > AFTER_LEAST * c->top)
        to++;
    if (to - from < 1)
        return c->t[last];
    struct line after = shape_line_through(c->t, c->p, from, to);
    double corner = c->t[last];
    if (late->slope - after.slope > 0.3 * late->slope)
        corner = (after.p - after.slope * after.t - late->p + late->slope * late->t) / (late->slope - after.slope);
    return fmax(c->t[last > 0 ? last - 1 : 0], fmin(c->t[from], corner));
}

/* When the deflection is back at rest: where the line of its last way down meets zero. */
static double shape_release_of(const struct course *c, int last)
{
    int low = last;
    while (low < c->n && c->p[low] > PUSH_FROM * c->top)
        low++;
    int high = low;
    while (high > last && c->p[high - 1] < ONSET_TO * c->top)
        high--;
    if (low >= c->n || low - 1 - high < 1)
        return (double)NAN;
    struct line line = shape_line_through(c->t, c->p, high, low - 1);
    return line.slope < 0.0 ? line.t - line.p / line.slope : (double)NAN;
}

/* Value at a time, on straight lines between bins and beyond the ends. */
static double shape_value_at(const struct course *c, const double *values, double t)
{
    int i = 0;
    while (i < c->n - 2 && c->t[i + 1] < t)
        i++;
    return values[i] + (values[i + 1] - values[i]) * (t - c->t[i]) / (c->t[i + 1] - c->t[i]);
}

/* Longest run of equal samples in a channel that bends, as a share of all samples. */
static double shape_frozen_of(const struct nav_trace *trace, const double *direction)
{
    int longest = 0;
    for (int a = 0; a < trace->axes; a++)
        if (fabs(direction[a]) > BENDS && trace->longest[a] > longest)
            longest = trace->longest[a];
    return (double)longest / (double)trace->good;
}

static void shape_measure(const struct nav_trace *trace, const struct course *c, double noise, struct nav_shape *shape)
{
    struct line early = shape_line_through(c->t, c->p, c->from, shape_first_above(c, ONSET_TO));
    struct line late = shape_line_through(c->t, c->p, shape_first_above(c, LATE_FROM), c->to);
    int last = shape_last_on(c, &late, noise);
    double left_over = 0.0;
    if (!(early.slope > 0.0) || !(late.slope > 0.0))
        return;
    double onset = early.t - early.p / early.slope;
    double stop = shape_stop_of(c, &late, last, trace->last.t_s);
    double release = shape_release_of(c, last);
    if (!(stop > onset))
        return;
    shape->bow = shape_bow_of(c, &left_over);
    shape->peak = shape_line_at(&late, stop);
    shape->slope = early.slope;
    shape->turn = shape_value_at(c, c->turn, stop) - shape_value_at(c, c->turn, onset);
    shape->reported = shape_value_at(c, c->reported, stop) - shape_value_at(c, c->reported, onset);
    shape->misfit = left_over / shape->peak;
    shape->back = release > stop ? log((release - stop) / (stop - onset)) : (double)NAN;
    shape->onset_s = trace->start_s + onset;
    shape->stop_s = trace->start_s + stop;
    shape->release_s = trace->start_s + release;
    shape->frozen = shape_frozen_of(trace, shape->direction) * trace->last.t_s / (stop - onset);
    shape->quality = NAV_SHAPE_WHOLE;
}

void nav_shape_of(const struct nav_trace *trace, struct nav_shape *shape)
{
    *shape = (struct nav_shape){.quality = NAV_SHAPE_NONE, .release_s = (double)NAN, .back = (double)NAN};
    long samples = trace->good + trace->bad;
    shape->bad = samples > 0 ? (double)trace->bad / (double)samples : 1.0;
    struct course c = {.n = trace->used};
    if (c.n < REST_BINS)
        return;
    shape_lay_out(trace, &c, shape->direction);
    shape_find_top(&c);
    shape_find_push(&c);
    double noise = shape_settle_rest(&c);
    if (!(c.top > STANDS_OUT * noise) || !(c.top > 0.0))
        return;
    shape->quality = NAV_SHAPE_PEAK;
    shape->raw_peak = shape->peak = c.top;
    shape->noise = noise / c.top;
    if (c.to - c.from >= 2)
        shape_measure(trace, &c, noise, shape);
}
