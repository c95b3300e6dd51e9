#include "intake.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The Create drives at most 0.5 m/s and a row may carry a whole body whisk; beyond this a cell is a mistake. */
static const double ODOMETRY_MOST_M = 1.0;
static const double LOGLIK_MOST = 1e9;
static const double LENGTH_SLACK = 1.5; /* a fitted line may answer a little more than the whisker's length */

int nav_intake_init(struct nav_intake *in, const struct nav_problem *problem)
{
    size_t tips = (size_t)problem->robot.tips, rays = (size_t)problem->robot.rays, whiskers = tips + rays;
    size_t classes = (size_t)problem->arena.classes;
    *in = (struct nav_intake){.problem = problem, .latest = -INFINITY};
    nav_gaps_init(&in->gaps);
    in->moved = calloc(whiskers + 1, sizeof *in->moved);
    in->touching = calloc(rays + 1, sizeof *in->touching);
    in->values = calloc(tips * classes + rays + 1, sizeof *in->values);
    in->reading = calloc(whiskers + 1, sizeof *in->reading);
    in->weight = calloc(whiskers + 1, sizeof *in->weight);
    if (!in->moved || !in->touching || !in->values || !in->reading || !in->weight ||
        nav_repeat_init(&in->repeat, problem->robot.tips, problem->arena.classes, problem->arena.tile))
        return -1;
    for (size_t w = 0; w < whiskers; w++) {
        in->moved[w] = INFINITY; /* the first reading is all new */
        in->reading[w] = in->values + (w < tips ? w * classes : tips * classes + w - tips);
    }
    return 0;
}

void nav_intake_free(struct nav_intake *in)
{
    free(in->moved);
    free(in->touching);
    free(in->values);
    free(in->reading);
    free(in->weight);
    nav_repeat_free(&in->repeat);
}

enum arrival { ON_TIME, LATE, REPEATED };

static enum arrival arrival_of(struct nav_intake *in, double t_s)
{
    if (!isfinite(t_s)) {
        in->bad_cells++;
        return ON_TIME;
    }
    long known = in->rows < NAV_TIMES_KEPT ? in->rows : NAV_TIMES_KEPT;
    for (long i = 0; i < known; i++) {
        if (in->times[i] == t_s)
            return REPEATED;
    }
    in->times[in->rows++ % NAV_TIMES_KEPT] = t_s;
    return t_s < in->latest ? LATE : ON_TIME;
}

static bool odometry_ok(struct nav_intake *in, const double odometry[3])
{
    uint64_t before = in->bad_cells;
    for (int i = 0; i < 3; i++) {
        if (!(fabs(odometry[i]) <= (i < 2 ? ODOMETRY_MOST_M : NAV_PI)))
            in->bad_cells++;
    }
    return in->bad_cells == before;
}

static struct nav_motion take_odometry(struct nav_intake *in, const struct nav_row *row, enum arrival arrival)
{
    struct nav_pose step = {row->odometry[0], row->odometry[1], row->odometry[2]};
    bool known = odometry_ok(in, row->odometry), timed = isfinite(row->t_s) != 0;
    if (arrival == LATE && known)
        return nav_gaps_fill(&in->gaps, step, row->t_s);
    if (arrival == LATE)
        return (struct nav_motion){.unknown_m = 0.0}; /* assumed when it did not come */
    double before = in->latest;
    int missing = timed ? nav_gaps_missing(&in->gaps, before, row->t_s) : 0;
    if (timed)
        in->latest = row->t_s;
    return nav_gaps_bridge(&in->gaps, known ? &step : NULL, missing, before, row->t_s);
}

static double lever(const struct nav_robot *robot, int whisker)
{
    if (whisker < robot->tips)
        return hypot(robot->tip[whisker].x, robot->tip[whisker].y);
    const struct nav_ray *ray = &robot->ray[whisker - robot->tips];
    return hypot(ray->x + ray->length * cos(ray->yaw), ray->y + ray->length * sin(ray->yaw));
}

static void add_path(struct nav_intake *in, const struct nav_motion *motion)
{
    const struct nav_robot *robot = &in->problem->robot;
    double distance = hypot(motion->step.x, motion->step.y) + motion->unknown_m;
    double turn = fabs(motion->step.theta) + motion->unknown_rad;
    for (int w = 0; w < robot->tips + robot->rays; w++)
        in->moved[w] += distance + lever(robot, w) * turn;
}

/* Share of a reading that is new: a whisker that has hardly moved says again what it said before. */
static double novelty(double moved, double spacing)
{
    return moved >= spacing ? 1.0 : moved / spacing;
}

static bool says_nothing(const double *loglik, int classes)
{
    for (int k = 1; k < classes; k++) {
        if (loglik[k] != loglik[0])
            return false;
    }
    return classes > 1;
}

static int best_of(const double *loglik, int classes)
{
    int best = 0;
    for (int k = 1; k < classes; k++)
        best = loglik[k] > loglik[best] ? k : best;
    return best;
}

static double take_texture(struct nav_intake *in, int tip, const double *loglik)
{
    int classes = in->problem->arena.classes;
    double *out = in->values + tip * classes;
    if (isnan(loglik[0]))
        return 0.0;
    uint64_t before = in->bad_cells;
    for (int k = 0; k < classes; k++) {
        if (!(fabs(loglik[k]) <= LOGLIK_MOST))
            in->bad_cells++;
        out[k] = loglik[k];
    }
    if (in->bad_cells != before)
        return 0.0;
    if (says_nothing(out, classes)) {
        in->empty++;
        return 0.0;
    }
    /* That a whisker has hardly moved and that errors repeat are two accounts of one thing: the stronger one counts. */
    double weight = novelty(in->moved[tip], in->problem->settings.texture_spacing_m);
    if (weight > 0.0)
        weight = fmin(weight, nav_repeat_take(&in->repeat, tip, best_of(out, classes), in->moved[tip]));
    in->moved[tip] = 0.0;
    return weight;
}

static double take_radial(struct nav_intake *in, int ray, double distance)
{
    const struct nav_robot *robot = &in->problem->robot;
    int whisker = robot->tips + ray;
    if (isnan(distance))
        return 0.0;
    if (distance < 0.0 || (isfinite(distance) && distance > LENGTH_SLACK * robot->ray[ray].length)) {
        in->bad_cells++;
        return 0.0;
    }
    in->values[robot->tips * in->problem->arena.classes + ray] = distance;
    bool touching = isfinite(distance) != 0, changed = touching != in->touching[ray];
    double weight = changed ? 1.0 : novelty(in->moved[whisker], in->problem->settings.radial_spacing_m);
    in->touching[ray] = touching;
    in->moved[whisker] = 0.0;
    return weight;
}

static bool take_readings(struct nav_intake *in, const struct nav_row *row)
{
    const struct nav_robot *robot = &in->problem->robot;
    bool any = false;
    for (int t = 0; t < robot->tips; t++)
        in->weight[t] = take_texture(in, t, row->texture + t * in->problem->arena.classes);
    for (int r = 0; r < robot->rays; r++)
        in->weight[robot->tips + r] = take_radial(in, r, row->radial_m[r]);
    for (int w = 0; w < robot->tips + robot->rays; w++)
        any = any || in->weight[w] > 0.0;
    return any;
}

bool nav_intake_take(struct nav_intake *in, const struct nav_row *row, struct nav_motion *motion,
                     struct nav_evidence *evidence)
{
    *motion = (struct nav_motion){.unknown_m = 0.0};
    *evidence = (struct nav_evidence){.reading = in->reading, .weight = in->weight};
    enum arrival arrival = arrival_of(in, row->t_s);
    if (arrival != ON_TIME)
        in->bad_rows++;
    if (arrival == REPEATED)
        return false;
    *motion = take_odometry(in, row, arrival);
    add_path(in, motion);
    /* A late row's motion is real, but its readings belong to a pose that is gone. */
    return arrival == ON_TIME && take_readings(in, row);
}
