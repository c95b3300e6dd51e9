#include "contact_trace.h"

#include <math.h>
#include <stdbool.h>

void nav_trace_begin(struct nav_trace *trace, int axes)
{
    trace->axes = axes < 1 ? 1 : axes > NAV_TRACE_AXES ? NAV_TRACE_AXES : axes;
    trace->used = trace->filled = 0;
    trace->width = 1;
    trace->good = trace->bad = 0;
    for (int a = 0; a < NAV_TRACE_AXES; a++)
        trace->equal[a] = trace->longest[a] = 0;
    trace->last = (struct nav_trace_point){0};
}

static void trace_order(double *a, double *b)
{
    double low = *a < *b ? *a : *b;
    *b = *a < *b ? *b : *a;
    *a = low;
}

/* Median of five, by the comparisons that it takes. */
static double trace_median(double a, double b, double c, double d, double e)
{
    trace_order(&a, &b);
    trace_order(&d, &e);
    trace_order(&a, &d);
    trace_order(&b, &e);
    trace_order(&b, &c);
    trace_order(&c, &d);
    trace_order(&b, &c);
    return c;
}

static void trace_add_point(struct nav_trace_point *sum, const struct nav_trace_point *point, int axes)
{
    sum->t_s += point->t_s;
    sum->turn += point->turn;
    sum->reported += point->reported;
    for (int a = 0; a < axes; a++)
        sum->at[a] += point->at[a];
}

static void trace_join_neighbours(struct nav_trace *trace)
{
    for (int i = 0; i < NAV_TRACE_BINS / 2; i++) {
        struct nav_trace_point joined = trace->sum[2 * i];
        trace_add_point(&joined, &trace->sum[2 * i + 1], trace->axes);
        trace->sum[i] = joined;
    }
    trace->used = NAV_TRACE_BINS / 2;
    trace->width *= 2;
    trace->filled = trace->width;
}

static void trace_bin_point(struct nav_trace *trace, const struct nav_trace_point *point)
{
    if (trace->used == 0 || trace->filled == trace->width) {
        if (trace->used == NAV_TRACE_BINS)
            trace_join_neighbours(trace);
        trace->sum[trace->used++] = (struct nav_trace_point){0};
        trace->filled = 0;
    }
    trace->filled++;
    trace_add_point(&trace->sum[trace->used - 1], point, trace->axes);
}

/* The middle one of the last five samples, its channels the medians. */
static struct nav_trace_point trace_middle(const struct nav_trace *trace)
{
    const struct nav_trace_point *r = trace->recent;
    struct nav_trace_point point = r[(trace->good - 3) % NAV_TRACE_MEDIAN];
    for (int a = 0; a < trace->axes; a++)
        point.at[a] = trace_median(r[0].at[a], r[1].at[a], r[2].at[a], r[3].at[a], r[4].at[a]);
    return point;
}

static bool trace_usable(const struct nav_trace *trace, double t_s, const double *sample)
{
    bool fine = isfinite(t_s) && (trace->good == 0 || t_s - trace->start_s > trace->last.t_s);
    for (int a = 0; a < trace->axes; a++)
        fine = fine && isfinite(sample[a]);
    return fine;
}

static void trace_count_equal(struct nav_trace *trace, const struct nav_trace_point *now)
{
    for (int a = 0; a < trace->axes; a++) {
        bool same = trace->good > 0 && !(now->at[a] < trace->last.at[a]) && !(now->at[a] > trace->last.at[a]);
        trace->equal[a] = same ? trace->equal[a] + 1 : 0;
        trace->longest[a] = trace->equal[a] > trace->longest[a] ? trace->equal[a] : trace->longest[a];
    }
}

static double trace_turned(double rate, double seconds)
{
    return isfinite(rate) ? fabs(rate) * seconds : seconds;
}

void nav_trace_add(struct nav_trace *trace, double t_s, const double *sample, double whisk_rad_s, double reported_rad_s)
{
    if (!trace_usable(trace, t_s, sample)) {
        trace->bad++;
        return;
    }
    if (trace->good == 0)
        trace->start_s = t_s;
    double since = t_s - trace->start_s - trace->last.t_s;
    struct nav_trace_point now = {.t_s = t_s - trace->start_s,
                                  .turn = trace->last.turn + trace_turned(whisk_rad_s, since),
                                  .reported = trace->last.reported + trace_turned(reported_rad_s, since)};
    for (int a = 0; a < trace->axes; a++)
        now.at[a] = sample[a];
    trace_count_equal(trace, &now);
    trace->last = now;
    trace->recent[trace->good % NAV_TRACE_MEDIAN] = now;
    trace->good++;
    if (trace->good >= NAV_TRACE_MEDIAN) {
        struct nav_trace_point point = trace_middle(trace);
        trace_bin_point(trace, &point);
    }
}

void nav_trace_run(struct nav_trace *trace, size_t n, const double *t_s, const double *samples,
                   const double *whisk_rad_s, const double *reported_rad_s)
{
    for (size_t i = 0; i < n; i++)
        nav_trace_add(trace, t_s[i], samples + i * (size_t)trace->axes, whisk_rad_s ? whisk_rad_s[i] : (double)NAN,
                      reported_rad_s ? reported_rad_s[i] : (double)NAN);
}
