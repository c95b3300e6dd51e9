#include "intake.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A base drives at most 5 m/s (crunchbot/base_table.py), for 0.1 s or what a late report adds, and a body whisk, which
 * a row may carry whole, is on the spot; beyond this a cell is a mistake. */
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
    in->moved = calloc(sensors + 1, sizeof *in->moved);
    if (!in->track || !in->values || !in->reading || !in->weight || !in->moved ||
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
    free(in->moved);
    nav_repeat_free(&in->repeat);
}

/* SAME: another row with the latest stamp, as of a clock that stands or has a coarse step. REPEATED: the same row. */
enum arrival { ON_TIME, SAME, LATE, REPEATED };

static uint64_t intake_mix(uint64_t mark, const double *numbers, int count)
{
    for (int n = 0; n < count; n++) {
        uint64_t bits;
        memcpy(&bits, &numbers[n], sizeof bits);
        mark = (mark ^ bits) * 0x9e3779b97f4a7c15u; /* 2^64 by the golden ratio: an odd number without a pattern */
        mark ^= mark >> 32;
    }
    return mark;
}

/* A number that two rows share only when they are the same row: noise makes no two of them alike. */
static uint64_t intake_mark(const struct nav_intake *in, const struct nav_row *row)
{
    uint64_t mark = intake_mix(intake_mix(0, &row->t_s, 1), row->odometry, 3);
    for (int w = 0; w < in->sensors.count; w++) {
        const struct nav_model *model = &in->sensors.model[w];
        const double *cells = model->kind->cells(model, row);
        mark = intake_mix(mark, cells, cells ? model->values : 0);
    }
    return mark;
}

static enum arrival intake_arrival_of(struct nav_intake *in, const struct nav_row *row)
{
    if (!isfinite(row->t_s)) {
        in->bad_cells++;
        return ON_TIME;
    }
    uint64_t mark = intake_mark(in, row);
    long known = in->rows < NAV_ROWS_KEPT ? in->rows : NAV_ROWS_KEPT;
    for (long i = 0; i < known; i++) {
        if (in->marks[i] == mark)
            return REPEATED;
    }
    in->marks[in->rows++ % NAV_ROWS_KEPT] = mark;
    if (row->t_s == in->latest)
        return SAME;
    return row->t_s < in->latest ? LATE : ON_TIME;
}

bool nav_row_carried(const struct nav_row *row)
{
    return isinf(row->odometry[0]) || isinf(row->odometry[1]) || isinf(row->odometry[2]);
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
    bool known = !nav_row_carried(row) && intake_odometry_ok(in, row->odometry);
    if (arrival == LATE && known)
        return nav_gaps_fill(&in->gaps, step, row->t_s);
    if (arrival == LATE)
        return (struct nav_motion){.unknown_m = 0.0}; /* assumed when it did not come */
    double before = in->latest;
    bool onward = arrival == ON_TIME && isfinite(row->t_s);
    double due = before + in->untimed * in->gaps.period_s;
    int missing = onward ? nav_gaps_missing(&in->gaps, due, row->t_s) : 0;
    in->untimed = onward ? 0 : in->untimed + 1;
    if (onward)
        in->latest = row->t_s;
    return nav_gaps_bridge(&in->gaps, known ? &step : NULL, missing, before, row->t_s);
}

static void intake_add_path(struct nav_intake *in, const struct nav_motion *motion)
{
    double distance = hypot(motion->step.x, motion->step.y) + motion->unknown_m;
    double turn = fabs(motion->step.theta) + motion->unknown_rad;
    for (int w = 0; w < in->sensors.count; w++)
        in->track[w].moved +=
            motion->carried ? (double)INFINITY : distance + nav_model_lever(&in->sensors.model[w]) * turn;
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
    in->moved[w] = in->track[w].moved;
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
    *evidence =
        (struct nav_evidence){.reading = in->reading, .weight = in->weight, .track = in->track, .moved = in->moved};
    enum arrival arrival = intake_arrival_of(in, row);
    if (arrival != ON_TIME)
        in->bad_rows++;
    if (arrival == REPEATED)
        return false;
    *motion = intake_take_odometry(in, row, arrival);
    motion->carried = nav_row_carried(row);
    intake_add_path(in, motion);
    /* The motion of a row out of order is real, but its readings belong to a pose that is gone, or that nobody knows.
     */
    return arrival == ON_TIME && intake_take_readings(in, row);
}
