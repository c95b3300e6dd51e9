#include "gap.h"

#include <math.h>
#include <stdbool.h>

static const double ROW_S = 0.1;
static const double PERIOD_STEP = 0.1; /* of the running median's logarithm, per row */
static const double USUAL_ROWS = 20.0; /* memory of the running means */
static const double SAME_ROWS = 10.0;  /* after so many missing rows nothing is known of the robot's way */
static const int MISSING_MOST = 100;

void nav_gaps_init(struct nav_gaps *g)
{
    *g = (struct nav_gaps){.period_s = ROW_S};
}

int nav_gaps_missing(struct nav_gaps *g, double from_s, double until_s)
{
    double between = until_s - from_s;
    if (!isfinite(between))
        return 0;
    double missing = floor(between / g->period_s - 0.5);
    g->period_s = fmax(g->period_s * exp(between > g->period_s ? PERIOD_STEP : -PERIOD_STEP), ROW_S);
    return (int)fmin(fmax(missing, 0.0), MISSING_MOST);
}

static double gap_apart(struct nav_pose a, struct nav_pose b)
{
    return hypot(a.x - b.x, a.y - b.y);
}

static struct nav_pose gap_scaled(struct nav_pose step, double by)
{
    return (struct nav_pose){by * step.x, by * step.y, by * step.theta};
}

static struct nav_pose gap_between(struct nav_pose a, struct nav_pose b)
{
    return (struct nav_pose){(a.x + b.x) / 2.0, (a.y + b.y) / 2.0, (a.theta + b.theta) / 2.0};
}

/* Whether a row's odometry looks like that of all rows since the last one. */
static bool gap_covers(struct nav_pose step, struct nav_pose last, int missing)
{
    struct nav_pose all = gap_scaled(last, missing + 1.0);
    return gap_apart(step, all) + fabs(step.theta - all.theta) < gap_apart(step, last) + fabs(step.theta - last.theta);
}

/* Motion of `missing` rows between two that moved so. */
static struct nav_motion gap_assume(struct nav_gaps *g, struct nav_pose before, struct nav_pose after, int missing,
                                    double from_s, double until_s)
{
    double unusual = fmin(missing / SAME_ROWS, 1.0);
    struct nav_pose each = gap_scaled(gap_between(before, after), 1.0 - unusual);
    g->kept[g->count++ % NAV_GAPS_KEPT] = (struct nav_gap){from_s, until_s, each, missing};
    return (struct nav_motion){
        .step = gap_scaled(each, missing),
        .unknown_m = missing * (gap_apart(before, after) / 2.0 + unusual * g->usual_m),
        .unknown_rad = missing * (fabs(before.theta - after.theta) / 2.0 + unusual * g->usual_rad),
    };
}

struct nav_motion nav_gaps_bridge(struct nav_gaps *g, const struct nav_pose *step, int missing, double from_s,
                                  double until_s)
{
    struct nav_motion motion = {.unknown_m = 0.0};
    if (!step) { /* this row's motion is as good as missing, and never comes */
        motion.unknown_m = (missing + 1) * g->usual_m;
        motion.unknown_rad = (missing + 1) * g->usual_rad;
        return motion;
    }
    bool lost = missing > 0 && !gap_covers(*step, g->last, missing);
    if (lost)
        motion = gap_assume(g, g->last, *step, missing, from_s, until_s);
    motion.step = nav_compose(motion.step, *step);
    double rows = lost ? 1.0 : 1.0 + missing;
    g->last = gap_scaled(*step, 1.0 / rows);
    g->usual_m += (hypot(step->x, step->y) / rows - g->usual_m) / USUAL_ROWS;
    g->usual_rad += (fabs(step->theta) / rows - g->usual_rad) / USUAL_ROWS;
    return motion;
}

struct nav_motion nav_gaps_fill(struct nav_gaps *g, struct nav_pose step, double t_s)
{
    for (int n = 0; n < NAV_GAPS_KEPT; n++) {
        struct nav_gap *gap = &g->kept[n];
        if (t_s <= gap->from_s || t_s >= gap->until_s || gap->missing == 0)
            continue;
        gap->missing--;
        step = (struct nav_pose){step.x - gap->each.x, step.y - gap->each.y, step.theta - gap->each.theta};
        break;
    }
    return (struct nav_motion){.step = step};
}
