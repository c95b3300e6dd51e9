#include "repeat.h"

#include <math.h>
#include <stdlib.h>

/* Assumed beside what was seen, as if seen so many times: windows, runs that were wrong, those of more than one
 * window. */
static const double WINDOWS = 20.0, WRONG = 3.0, REPEATED = 1.0;
static const double LIKE_BEFORE = 2.0; /* runs: a later place is taken to be like the one before it, worth so many */
static const double MEMORY = 2000.0;   /* windows */
static const double WRONG_LEAST = 0.02, REPEAT_MOST = 0.95;

int nav_repeat_init(struct nav_repeat *r, int tips, int classes, double tile)
{
    *r = (struct nav_repeat){.classes = classes, .path_most = tile / 2.0};
    r->tip = calloc((size_t)tips + 1, sizeof *r->tip);
    for (int t = 0; r->tip && t < tips; t++)
        r->tip[t][0].said = r->tip[t][1].said = r->tip[t][2].said = -1;
    return r->tip ? 0 : -1;
}

void nav_repeat_free(struct nav_repeat *r)
{
    free(r->tip);
}

/* Chance that a run of so many wrong windows goes on. */
static double repeat_again_after(const struct nav_repeat *r, double count)
{
    double again = (r->repeated[0] + REPEATED) / (r->wrong[0] + WRONG);
    for (int n = 1; n < NAV_REPEAT_PLACES && n < count; n++)
        again = (r->repeated[n] + LIKE_BEFORE * again) / (r->wrong[n] + LIKE_BEFORE);
    return again;
}

/* What is new in a window that says the same as `count` before it. */
static double repeat_share_of_same(const struct nav_repeat *r, double count)
{
    double others = fmax(r->classes - 1.0, 1.0), all = WRONG;
    for (int n = 0; n < NAV_REPEAT_PLACES; n++)
        all += r->wrong[n];
    double wrong = fmin(fmax(all / (r->windows + WINDOWS), WRONG_LEAST), others / (others + 1.0)) / others;
    return log(fmin(fmax(repeat_again_after(r, count), wrong), REPEAT_MOST)) / log(wrong);
}

/* Once the last run is as long as the middle one: counts the middle one as wrong, by the share of the belief that did
 * not expect it, and makes one run of all three. */
static void repeat_judge(struct nav_repeat *r, struct nav_repeat_run run[3])
{
    bool between = run[0].said == run[2].said && run[1].said >= 0 && run[1].path <= r->path_most;
    if (!between || run[1].count > run[0].count || run[1].count > run[2].count)
        return;
    double unexpected = fmax(1.0 - run[1].expected / run[1].count, 0.0);
    for (double n = 1.0; n <= run[1].count; n += 1.0) {
        int place = (int)fmin(n, NAV_REPEAT_PLACES) - 1;
        r->wrong[place] += unexpected;
        r->repeated[place] += n < run[1].count ? unexpected : 0.0;
    }
    run[2].count += run[0].count + run[1].count;
    run[2].path += run[0].path + run[1].path;
    run[2].expected += run[0].expected + run[1].expected;
    run[0].said = run[1].said = -1;
}

static void repeat_fade(struct nav_repeat *r)
{
    double keep = 1.0 - 1.0 / MEMORY;
    r->windows = r->windows * keep + 1.0;
    for (int n = 0; n < NAV_REPEAT_PLACES; n++) {
        r->wrong[n] *= keep;
        r->repeated[n] *= keep;
    }
}

double nav_repeat_take(struct nav_repeat *r, int tip, int said, double moved, double expected)
{
    struct nav_repeat_run *run = r->tip[tip];
    bool same = said == run[2].said;
    repeat_fade(r);
    run[2].expected += expected;
    if (!same) {
        run[0] = run[1];
        run[1] = run[2];
        run[2] = (struct nav_repeat_run){.said = said};
    }
    double share = same ? repeat_share_of_same(r, run[2].count) : 1.0;
    run[2].count += 1.0;
    run[2].path += moved;
    repeat_judge(r, run);
    return share;
}
