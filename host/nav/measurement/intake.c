#include "intake.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The Create drives at most 0.5 m/s and a row may carry a whole body whisk; beyond this a cell is a mistake. */
static const double ODOMETRY_MOST_M = 1.0;

int nav_intake_init(struct nav_intake *in, const struct nav_problem *problem)
{
    *in = (struct nav_intake){.problem = problem, .latest = -INFINITY};
    nav_gaps_init(&in->gaps);
    if (nav_sensors_init(&in->sensors, &problem->arena, &problem->robot, &problem->settings, 0.0))
        return -1;
    size_t sensors = (size_t)in->sensors.count, values = 0;
    for (size_t w = 0; w < sensors; w++)
        values += (size_t)in->sensors.model[w].values;
    in->track = calloc(sensors + 1, sizeof *in->track);
    in->values = calloc(values + 1, sizeof *in->values);
    in->reading = calloc(sensors + 1, sizeof *in->reading);
    in->weight = calloc(sensors + 1, sizeof *in->weight);
    if (!in->track || !in->values || !in->reading || !in->weight ||
        nav_repeat_init(&in->repeat, problem->robot.tips, problem->arena.classes, problem->arena.tile))
        return -1;
    double *value = in->values;
    for (size_t w = 0; w < sensors; w++) {
        in->track[w].moved = INFINITY; /* the first reading is all new */
        in->reading[w] = value;
        value += in->sensors.model[w].values;
    }
    return 0;
}

void nav_intake_free(struct nav_intake *in)
{
    nav_sensors_free(&in->sensors);
    free(in->track);
    free(in->values);
    free(in->reading);
    free(in->weight);
    nav_repeat_free(&in->repeat);
}

enum arrival { ON_TIME, LATE, REPEATED };

static enum arrival intake_arrival_of(struct nav_intake *in, double t_s)
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

static bool intake_odometry_ok(struct nav_intake *in, const double odometry[3])
{
    uint64_t before = in->bad_cells;
    for (int i = 0; i < 3; i++) {
        if (!(fabs(odometry[i]) <= (i < 2 ? ODOMETRY_MOST_M : NAV_PI)))
            in->bad_cells++;
    }
    return in->bad_cells == before;
}

static struct nav_motion intake_take_odometry(struct nav_intake *in, const struct nav_row *row, enum arrival arrival)
{
    struct nav_pose step = {row->odometry[0], row->odometry[1], row->odometry[2]};
    bool known = intake_odometry_ok(in, row->odometry), timed = isfinite(row->t_s) != 0;
    if (arrival == LATE && known)
        return nav_gaps_fill(&in->gaps, step, row->t_s);
    if (arrival == LATE)
        return (struct nav_motion){.unknown_m = 0.0}; /* assumed when it did not come */
    double before = in->latest;
    bool bridged = timed && in->problem->settings.motion.gaps >= 0.5;
    int missing = bridged ? nav_gaps_missing(&in->gaps, before, row->t_s) : 0;
    if (timed)
        in->latest = row->t_s;
    return nav_gaps_bridge(&in->gaps, known ? &step : NULL, missing, before, row->t_s);
}

/* Distance from the robot's centre to the end of a sensor. */
static double intake_lever(const struct nav_model *model)
{
    return hypot(model->place.x + model->length * model->place.c, model->place.y + model->length * model->place.s);
}

static void intake_add_path(struct nav_intake *in, const struct nav_motion *motion)
{
    double distance = hypot(motion->step.x, motion->step.y) + motion->unknown_m;
    double turn = fabs(motion->step.theta) + motion->unknown_rad;
    for (int w = 0; w < in->sensors.count; w++)
        in->track[w].moved += distance + intake_lever(&in->sensors.model[w]) * turn;
}

/* Takes sensor w's reading from a row; returns how much of it counts. */
static double intake_read(struct nav_intake *in, int w, const struct nav_row *row)
{
    const struct nav_model *model = &in->sensors.model[w];
    const double *cells = model->kind->cells(model, row);
    enum nav_check check = model->kind->check(model, cells, &in->bad_cells);
    in->empty += check == NAV_EMPTY;
    if (check != NAV_READ)
        return 0.0;
    double *values = in->values + (in->reading[w] - in->values);
    memcpy(values, cells, (size_t)model->values * sizeof *values);
    double weight = model->kind->novelty(model, &in->track[w], &in->repeat, values);
    in->track[w].moved = 0.0;
    return weight;
}

static bool intake_take_readings(struct nav_intake *in, const struct nav_row *row)
{
    bool any = false;
    for (int w = 0; w < in->sensors.count; w++) {
        in->weight[w] = intake_read(in, w, row);
        any = any || in->weight[w] > 0.0;
    }
    return any;
}

bool nav_intake_take(struct nav_intake *in, const struct nav_row *row, struct nav_motion *motion,
                     struct nav_evidence *evidence)
{
    *motion = (struct nav_motion){.unknown_m = 0.0};
    *evidence = (struct nav_evidence){.reading = in->reading, .weight = in->weight, .track = in->track};
    enum arrival arrival = intake_arrival_of(in, row->t_s);
    if (arrival != ON_TIME)
        in->bad_rows++;
    if (arrival == REPEATED)
        return false;
    *motion = intake_take_odometry(in, row, arrival);
    intake_add_path(in, motion);
    /* A late row's motion is real, but its readings belong to a pose that is gone. */
    return arrival == ON_TIME && intake_take_readings(in, row);
}
