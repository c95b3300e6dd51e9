#include "intake.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The Create drives at most 0.5 m/s and a row may carry a whole body whisk; beyond this a cell is a mistake. */
static const double ODOMETRY_MOST_M = 1.0;
static const double LOGLIK_MOST = 1e9;
static const double ROW_S = 0.1;
static const double USUAL_ROWS = 20.0;  /* memory of the running means */
static const double LENGTH_SLACK = 1.5; /* a fitted line may answer a little more than the whisker's length */
static const int LOST_MOST = 100;

int nav_intake_init(struct nav_intake *in, const struct nav_problem *problem)
{
    size_t tips = (size_t)problem->robot.tips, rays = (size_t)problem->robot.rays, whiskers = tips + rays;
    size_t classes = (size_t)problem->arena.classes;
    *in = (struct nav_intake){.problem = problem, .latest = -INFINITY};
    in->moved = calloc(whiskers + 1, sizeof *in->moved);
    in->touching = calloc(rays + 1, sizeof *in->touching);
    in->values = calloc(tips * classes + rays + 1, sizeof *in->values);
    in->reading = calloc(whiskers + 1, sizeof *in->reading);
    in->weight = calloc(whiskers + 1, sizeof *in->weight);
    if (!in->moved || !in->touching || !in->values || !in->reading || !in->weight)
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
}

enum arrival { ON_TIME, LATE, REPEATED };

static enum arrival arrival_of(struct nav_intake *in, double t_s, int *lost)
{
    *lost = 0;
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
    if (t_s < in->latest)
        return LATE;
    double missing = isfinite(in->latest) ? floor((t_s - in->latest) / ROW_S - 0.5) : 0.0;
    *lost = (int)fmin(fmax(missing, 0.0), LOST_MOST);
    in->latest = t_s;
    return ON_TIME;
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

static void take_odometry(struct nav_intake *in, const double odometry[3], int lost, struct nav_motion *motion)
{
    if (odometry_ok(in, odometry)) {
        motion->step = (struct nav_pose){odometry[0], odometry[1], odometry[2]};
        in->usual_m += (hypot(odometry[0], odometry[1]) - in->usual_m) / USUAL_ROWS;
        in->usual_rad += (fabs(odometry[2]) - in->usual_rad) / USUAL_ROWS;
    } else {
        lost++;
    }
    motion->unknown_m = lost * in->usual_m;
    motion->unknown_rad = lost * in->usual_rad;
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
    double weight = novelty(in->moved[tip], in->problem->settings.texture_spacing_m);
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
    int lost;
    *motion = (struct nav_motion){.unknown_m = 0.0};
    *evidence = (struct nav_evidence){.reading = in->reading, .weight = in->weight};
    enum arrival arrival = arrival_of(in, row->t_s, &lost);
    if (arrival != ON_TIME)
        in->bad_rows++;
    if (arrival == REPEATED)
        return false;
    take_odometry(in, row->odometry, lost, motion);
    add_path(in, motion);
    /* A late row's motion is real, but its readings belong to a pose that is gone. */
    return arrival == ON_TIME && take_readings(in, row);
}
