#include "texture_clean.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#define VALUE_MOST 1e9 /* counts; squares and sums of longest windows stay far below the largest double */

/* Stands out to the same side of both neighbours by more than the limit; x lies within the window. */
static bool clean_spike(const double *x, ptrdiff_t step, double limit)
{
    double before = x[0] - x[-step], after = x[0] - x[step];
    return before * after > 0.0 && fabs(before) > limit && fabs(after) > limit;
}

/* Marks samples of a channel to leave out by nan, and counts them. A spike is marked only once its neighbours have been
 * judged: they need its value. */
static long clean_mark(double *x, ptrdiff_t step, int n, double limit)
{
    long bad = 0;
    bool last = false; /* whether the sample before is a spike */
    for (int i = 0; i < n; i++, x += step) {
        bool good = fabs(*x) <= VALUE_MOST;
        bool now = good && !last && i > 0 && i < n - 1 && clean_spike(x, step, limit);
        if (last)
            x[-step] = NAN;
        if (!good)
            *x = NAN;
        bad += now || !good;
        last = now;
    }
    return bad;
}

/* Draws a straight line through each run of marked samples. */
static void clean_fill(double *x, ptrdiff_t step, int n)
{
    for (int i = 0; i < n; i++) {
        int from = i;
        while (i < n && isnan(x[i * step]))
            i++;
        double left = from > 0 ? x[(from - 1) * step] : (i < n ? x[i * step] : 0.0), right = i < n ? x[i * step] : left;
        for (int k = from; k < i; k++)
            x[k * step] = left + (right - left) * (k - from + 1) / (i - from + 1);
    }
}

/* Whether clean_mark would find anything; no branch within, so it is quick where all is well. */
static bool clean_suspect(const double *x, ptrdiff_t step, int n, double limit)
{
    int bad = 0;
    for (int i = 0; i < n; i++)
        bad |= !(fabs(x[i * step]) <= VALUE_MOST);
    for (int i = 1; i < n - 1; i++) {
        double before = x[i * step] - x[(i - 1) * step], after = x[i * step] - x[(i + 1) * step];
        bad |= (before * after > 0.0) & (fabs(before) > limit) & (fabs(after) > limit);
    }
    return bad != 0;
}

struct range {
    double least, most;
};

static struct range clean_range(const double *x, ptrdiff_t step, int n)
{
    struct range r = {INFINITY, -INFINITY};
    for (int i = 0; i < n; i++) {
        r.least = x[i * step] < r.least ? x[i * step] : r.least;
        r.most = x[i * step] > r.most ? x[i * step] : r.most;
    }
    return r;
}

/* The longest run of equal samples, or of samples at or beyond a stop. */
static int clean_run(const double *x, ptrdiff_t step, int n, bool stops, double low, double high)
{
    int longest = 0;
    for (int i = 0, run = 0; i < n; i++, x += step) {
        bool on = stops ? *x <= low || *x >= high : i > 0 && *x == x[-step];
        run = on ? run + 1 : !stops;
        longest = run > longest ? run : longest;
    }
    return longest;
}

struct nav_texture_health nav_texture_clean(double *window, int n, const struct nav_texture_limits *limits)
{
    struct nav_texture_health health = {0};
    ptrdiff_t step = limits->channels;
    for (int c = 0; c < limits->channels; c++) {
        double spike = limits->spike ? limits->spike[c] : INFINITY;
        long bad = clean_suspect(window + c, step, n, spike) ? clean_mark(window + c, step, n, spike) : 0;
        if (bad > 0)
            clean_fill(window + c, step, n);
        health.bad = bad > health.bad ? bad : health.bad;
        double low = limits->low ? limits->low[c] : -INFINITY, high = limits->high ? limits->high[c] : INFINITY;
        struct range r = clean_range(window + c, step, n);
        health.still += limits->still && clean_run(window + c, step, n, false, low, high) > limits->still[c];
        health.railed += (r.least <= low || r.most >= high) && clean_run(window + c, step, n, true, low, high) > 1;
        health.caught += limits->span && r.most - r.least > limits->span[c];
    }
    return health;
}
