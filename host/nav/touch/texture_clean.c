#include "texture_clean.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#define VALUE_MOST 1e9 /* counts; squares and sums of longest windows stay far below the largest double */

struct view {
    double *at; /* first sample of the channel */
    int step, n;
};

static double *sample(struct view v, int i)
{
    return v.at + (size_t)i * (size_t)v.step;
}

static bool good(double x)
{
    return isfinite(x) && fabs(x) <= VALUE_MOST;
}

/* Stands out to the same side of both neighbours by more than the limit. */
static bool spike(struct view v, int i, double limit)
{
    if (i == 0 || i == v.n - 1)
        return false;
    double before = *sample(v, i) - *sample(v, i - 1), after = *sample(v, i) - *sample(v, i + 1);
    return before * after > 0.0 && fabs(before) > limit && fabs(after) > limit;
}

/* Marks samples to leave out by nan. A spike is marked only once its neighbours have been judged: they need its value.
 */
static long mark(struct view v, const double *limit)
{
    long bad = 0;
    bool last = false; /* whether sample i - 1 is a spike */
    for (int i = 0; i < v.n; i++) {
        double x = *sample(v, i);
        bool now = good(x) && limit && !last && spike(v, i, *limit);
        if (last)
            *sample(v, i - 1) = NAN;
        if (!good(x))
            *sample(v, i) = NAN;
        bad += now || !good(x);
        last = now;
    }
    return bad;
}

/* Whether `mark` would find anything; no branch within, so it is quick where all is well. */
static bool suspect(struct view v, double limit)
{
    int bad = 0;
    for (int i = 0; i < v.n; i++)
        bad |= !(fabs(*sample(v, i)) <= VALUE_MOST);
    for (int i = 1; i < v.n - 1; i++) {
        double before = *sample(v, i) - *sample(v, i - 1), after = *sample(v, i) - *sample(v, i + 1);
        bad |= (before * after > 0.0) & (fabs(before) > limit) & (fabs(after) > limit);
    }
    return bad != 0;
}

static void bridge(struct view v, int from, int to)
{
    double left = from > 0 ? *sample(v, from - 1) : (to < v.n ? *sample(v, to) : 0.0);
    double right = to < v.n ? *sample(v, to) : left;
    for (int i = from; i < to; i++)
        *sample(v, i) = left + (right - left) * (i - from + 1) / (to - from + 1);
}

static void fill(struct view v)
{
    for (int i = 0; i < v.n; i++) {
        int from = i;
        while (i < v.n && isnan(*sample(v, i)))
            i++;
        if (i > from)
            bridge(v, from, i);
    }
}

static int longest_run(struct view v)
{
    int longest = 1, run = 1;
    for (int i = 1; i < v.n; i++) {
        run = *sample(v, i) == *sample(v, i - 1) ? run + 1 : 1;
        longest = run > longest ? run : longest;
    }
    return longest;
}

/* Whether more than `limit` samples in a row are equal. Such a run holds every limit-th sample and one beside it. */
static bool still(struct view v, double limit)
{
    int apart = limit >= 1.0 && limit < v.n ? (int)limit : v.n;
    bool perhaps = limit < 1.0;
    for (int i = 0; i < v.n - 1; i += apart)
        perhaps |= *sample(v, i) == *sample(v, i + 1) || (i > 0 && *sample(v, i) == *sample(v, i - 1));
    return perhaps && longest_run(v) > limit;
}

struct range {
    double least, most;
};

static struct range range(struct view v)
{
    struct range r = {INFINITY, -INFINITY};
    for (int i = 0; i < v.n; i++) {
        double x = *sample(v, i);
        r.least = x < r.least ? x : r.least;
        r.most = x > r.most ? x : r.most;
    }
    return r;
}

/* Whether a sample at or beyond a stop follows another. */
static bool railed(struct view v, struct range r, double low, double high)
{
    bool was = false, found = false;
    for (int i = 0; i < v.n && (r.least <= low || r.most >= high); i++) {
        bool now = *sample(v, i) <= low || *sample(v, i) >= high;
        found |= now && was;
        was = now;
    }
    return found;
}

struct nav_texture_health nav_texture_clean(double *window, int n, const struct nav_texture_limits *limits)
{
    struct nav_texture_health health = {0};
    for (int c = 0; c < limits->channels; c++) {
        struct view v = {.at = window + c, .step = limits->channels, .n = n};
        const double *spike = limits->spike ? limits->spike + c : NULL;
        long bad = suspect(v, spike ? *spike : INFINITY) ? mark(v, spike) : 0;
        if (bad > 0)
            fill(v);
        health.bad = bad > health.bad ? bad : health.bad;
        struct range r = range(v);
        health.still += limits->still && still(v, limits->still[c]);
        health.railed +=
            railed(v, r, limits->low ? limits->low[c] : -INFINITY, limits->high ? limits->high[c] : INFINITY);
        health.caught += limits->span && r.most - r.least > limits->span[c];
    }
    return health;
}
