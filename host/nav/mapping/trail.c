#include "trail.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Changes of texture under a tip, 1 / m: the least, and each by the one before. */
static const double RATE_LEAST = 0.02, RATE_BY = 5.0;

int nav_trail_init(struct nav_trail *t, const struct nav_arena *arena, const struct nav_robot *robot)
{
    size_t classes = (size_t)arena->classes;
    *t = (struct nav_trail){.tips = robot->tips, .classes = arena->classes};
    t->point = calloc(NAV_TRAIL_MOST, sizeof *t->point);
    t->weight = calloc(NAV_TRAIL_MOST * classes, sizeof *t->weight);
    t->fresh = calloc(NAV_TRAIL_MOST, sizeof *t->fresh);
    t->tip = calloc(NAV_TRAIL_MOST, sizeof *t->tip);
    t->patch = calloc(NAV_TRAIL_RATES * (size_t)robot->tips * classes + 1, sizeof *t->patch);
    if (nav_borders_init(&t->finder, arena, robot) || !t->point || !t->weight || !t->fresh || !t->tip || !t->patch)
        return -1;
    nav_trail_clear(t);
    return 0;
}

void nav_trail_free(struct nav_trail *t)
{
    free(t->point);
    free(t->weight);
    free(t->fresh);
    free(t->tip);
    free(t->patch);
    nav_borders_free(&t->finder);
}

static void trail_clear_finder(struct nav_borders *b)
{
    size_t tips = (size_t)b->tips, all = tips * (size_t)b->classes;
    for (size_t tip = 0; tip < tips; tip++)
        b->surface[tip] = -1;
    memset(b->held, 0, tips * sizeof *b->held);
    memset(b->score, 0, all * sizeof *b->score);
    memset(b->since, 0, all * sizeof *b->since);
    nav_borders_row_done(b);
}

void nav_trail_clear(struct nav_trail *t)
{
    t->count = t->borders = 0;
    memset(t->evidence, 0, sizeof t->evidence);
    memset(t->all, 0, sizeof t->all);
    for (int n = 0; n < NAV_TRAIL_RATES * t->tips * t->classes; n++)
        t->patch[n] = 1.0 / t->classes;
    trail_clear_finder(&t->finder);
}

static void trail_copy_finder(struct nav_borders *to, const struct nav_borders *from)
{
    size_t tips = (size_t)from->tips, all = tips * (size_t)from->classes;
    memcpy(to->surface, from->surface, tips * sizeof *to->surface);
    memcpy(to->held, from->held, tips * sizeof *to->held);
    memcpy(to->score, from->score, all * sizeof *to->score);
    memcpy(to->since, from->since, all * sizeof *to->since);
    to->last = from->last;
}

void nav_trail_copy(struct nav_trail *to, const struct nav_trail *from)
{
    size_t count = (size_t)from->count, classes = (size_t)from->classes;
    to->count = from->count;
    to->borders = from->borders;
    memcpy(to->point, from->point, count * sizeof *to->point);
    memcpy(to->weight, from->weight, count * classes * sizeof *to->weight);
    memcpy(to->fresh, from->fresh, count * sizeof *to->fresh);
    memcpy(to->tip, from->tip, count * sizeof *to->tip);
    memcpy(to->border, from->border, (size_t)from->borders * sizeof *to->border);
    memcpy(to->patch, from->patch, NAV_TRAIL_RATES * (size_t)from->tips * classes * sizeof *to->patch);
    memcpy(to->evidence, from->evidence, sizeof to->evidence);
    memcpy(to->all, from->all, sizeof to->all);
    trail_copy_finder(&to->finder, &from->finder);
}

void nav_trail_move(struct nav_trail *t, struct nav_pose step)
{
    nav_borders_move(&t->finder, step);
}

/* Takes the window into the belief of patches; returns its log-likelihood. */
static double trail_patch(struct nav_trail *t, int rate, int tip, double moved, const float *ratio)
{
    double *patch = t->patch + (ptrdiff_t)(rate * t->tips + tip) * t->classes, total = 0.0;
    double keep = exp(-RATE_LEAST * pow(RATE_BY, rate) * moved);
    for (int k = 0; k < t->classes; k++) {
        patch[k] = (keep * patch[k] + (1.0 - keep) / t->classes) * (double)ratio[k];
        total += patch[k];
    }
    for (int k = 0; k < t->classes; k++)
        patch[k] /= total;
    return log(total);
}

static void trail_keep_border(struct nav_trail *t, struct nav_trail_point at)
{
    if (t->borders == NAV_TRAIL_BORDERS) {
        t->borders /= 2; /* every other one stays */
        for (int n = 0; n < t->borders; n++)
            t->border[n] = t->border[2 * n];
    }
    t->border[t->borders++] = at;
}

static struct nav_trail_point trail_place(const struct nav_pose *pose, const struct nav_tip *tip)
{
    double c = cos(pose->theta), s = sin(pose->theta);
    return (struct nav_trail_point){pose->x + c * tip->x - s * tip->y, pose->y + s * tip->x + c * tip->y};
}

void nav_trail_add(struct nav_trail *t, const struct nav_pose *pose, int tip, double moved, const float *ratio)
{
    float loglik[256];
    struct nav_crossing crossing;
    bool full = t->count == NAV_TRAIL_MOST;
    double best = -INFINITY;
    for (int rate = 0; rate < NAV_TRAIL_RATES; rate++) {
        double evidence = trail_patch(t, rate, tip, moved, ratio);
        if (!full && t->all[rate] > best) {
            best = t->all[rate];
            t->fresh[t->count] = (float)evidence;
        }
        t->all[rate] += evidence;
        t->evidence[rate] += full ? 0.0 : evidence;
    }
    for (int k = 0; k < t->classes; k++)
        loglik[k] = logf(ratio[k]);
    if (nav_borders_read(&t->finder, tip, loglik, &crossing))
        trail_keep_border(t, trail_place(pose, &crossing.point));
    if (full)
        return;
    t->tip[t->count] = (unsigned char)tip;
    memcpy(t->weight + (ptrdiff_t)t->count * t->classes, loglik, (size_t)t->classes * sizeof *loglik);
    t->point[t->count++] = trail_place(pose, &t->finder.tip[tip]);
}

double nav_trail_patches(const struct nav_trail *t, bool all)
{
    double best = -INFINITY;
    for (int rate = 0; rate < NAV_TRAIL_RATES; rate++)
        best = fmax(best, all ? t->all[rate] : t->evidence[rate]);
    return best;
}

void nav_trail_row_done(struct nav_trail *t)
{
    nav_borders_row_done(&t->finder);
}
