#include "borders.h"

#include <math.h>
#include <stdlib.h>

static const double SURE = 3.0;      /* nats: 20 to 1 */
static const double HELD_MOST = 6.0; /* nats */
static const double WINDOW_M = 0.01; /* a window's share in the uncertainty of the place */

int nav_borders_init(struct nav_borders *b, const struct nav_arena *arena, const struct nav_robot *robot)
{
    size_t tips = (size_t)robot->tips, all = tips * (size_t)arena->classes;
    *b = (struct nav_borders){.tips = robot->tips, .classes = arena->classes, .tip = robot->tip};
    b->surface = calloc(tips + 1, sizeof *b->surface);
    b->held = calloc(tips + 1, sizeof *b->held);
    b->score = calloc(all + 1, sizeof *b->score);
    b->since = calloc(all + 1, sizeof *b->since);
    for (size_t t = 0; b->surface && t < tips; t++)
        b->surface[t] = -1;
    return b->surface && b->held && b->score && b->since ? 0 : -1;
}

void nav_borders_free(struct nav_borders *b)
{
    free(b->surface);
    free(b->held);
    free(b->score);
    free(b->since);
}

void nav_borders_move(struct nav_borders *b, struct nav_pose step)
{
    for (int n = 0; n < b->tips * b->classes; n++)
        b->since[n] = nav_compose(b->since[n], step);
    b->last = nav_compose(b->last, step);
}

void nav_borders_row_done(struct nav_borders *b)
{
    b->last = (struct nav_pose){0.0, 0.0, 0.0};
}

/* A point fixed in the world that was at `tip` in the robot's frame before the motion, in its frame after. */
static struct nav_tip borders_left_behind(struct nav_pose motion, struct nav_tip tip)
{
    double c = cos(motion.theta), s = sin(motion.theta), dx = tip.x - motion.x, dy = tip.y - motion.y;
    return (struct nav_tip){c * dx + s * dy, c * dy - s * dx};
}

/* Between the last two readings, on average half way: where a change that begins to show now has taken place. */
static struct nav_pose borders_half(struct nav_pose motion)
{
    return (struct nav_pose){motion.x / 2.0, motion.y / 2.0, motion.theta / 2.0};
}

static void borders_describe(const struct nav_borders *b, int tip, int to, struct nav_crossing *out)
{
    struct nav_tip end = b->tip[tip], start = borders_left_behind(b->last, end);
    double dx = end.x - start.x, dy = end.y - start.y, path = hypot(dx, dy);
    *out = (struct nav_crossing){.from = b->surface[tip],
                                 .to = to,
                                 .point = borders_left_behind(b->since[tip * b->classes + to], b->tip[tip]),
                                 .sigma = hypot(WINDOW_M, path / 2.0)};
    if (path > 0.0)
        out->toward = (struct nav_tip){dx / path, dy / path};
}

static void borders_settle(struct nav_borders *b, int tip, int surface)
{
    b->surface[tip] = surface;
    for (int k = 0; k < b->classes; k++)
        b->score[tip * b->classes + k] = 0.0;
}

void nav_borders_forget(struct nav_borders *b)
{
    for (int t = 0; t < b->tips; t++) {
        b->held[t] = 0.0;
        borders_settle(b, t, -1);
    }
}

static int borders_best_of(const float *loglik, int classes)
{
    int best = 0;
    for (int k = 1; k < classes; k++)
        best = loglik[k] > loglik[best] ? k : best;
    return best;
}

bool nav_borders_read(struct nav_borders *b, int tip, const float *loglik, struct nav_crossing *out)
{
    double *score = b->score + tip * b->classes, against = -INFINITY;
    if (b->surface[tip] < 0)
        borders_settle(b, tip, borders_best_of(loglik, b->classes));
    int now = b->surface[tip], to = now;
    for (int k = 0; k < b->classes; k++) {
        if (k == now)
            continue;
        double ratio = (double)(loglik[k] - loglik[now]);
        against = fmax(against, ratio);
        if (!(score[k] > 0.0))
            b->since[tip * b->classes + k] = borders_half(b->last);
        score[k] = fmax(score[k] + ratio, 0.0);
        if (score[k] > SURE && (to == now || score[k] > score[to]))
            to = k;
    }
    bool settled = b->held[tip] >= SURE;
    if (to == now) {
        if (!settled && b->classes > 1)
            b->held[tip] = fmin(fmax(b->held[tip] - against, 0.0), HELD_MOST);
        return false;
    }
    borders_describe(b, tip, to, out);
    b->held[tip] = fmax(b->held[tip], score[to]);
    borders_settle(b, tip, to);
    return settled;
}
