#include "record.h"

#include <math.h>
#include <stdlib.h>

enum { ROWS_MOST = 20000, CELLS_MOST = 16000000 };
enum { HEAD = (sizeof(struct nav_pose) + sizeof(struct nav_noise)) / sizeof(double) }; /* numbers of a motion */
enum { PER_RAY = sizeof(struct nav_record_contact) / sizeof(float) };                  /* and of a contact */

/* Errors of the odometry keep their value over a whole turn on the spot, rad. */
static const double TURN_RAD = 2.0;

int nav_record_init(struct nav_record *r, const struct nav_problem *problem)
{
    const struct nav_robot *robot = &problem->robot;
    *r = (struct nav_record){
        .problem = problem, .rays = robot->rays, .tips = robot->tips, .classes = problem->arena.classes};
    r->width = HEAD + PER_RAY * r->rays + r->tips * (1 + r->classes);
    r->most = CELLS_MOST / r->width < ROWS_MOST ? CELLS_MOST / r->width : ROWS_MOST;
    r->cells = malloc((size_t)r->most * (size_t)r->width * sizeof *r->cells);
    r->moved = calloc((size_t)r->tips + 1, sizeof *r->moved);
    r->ratio = calloc(NAV_CODES_MOST, sizeof *r->ratio);
    return nav_intake_init(&r->intake, problem) || !r->cells || !r->moved || !r->ratio ? -1 : 0;
}

void nav_record_free(struct nav_record *r)
{
    nav_intake_free(&r->intake);
    free(r->cells);
    free(r->moved);
    free(r->ratio);
}

static const struct nav_model *record_models(const struct nav_record *r, const struct nav_measurement *kind, int *first)
{
    for (int k = 0; k < NAV_KINDS; k++) {
        if (NAV_MEASUREMENTS[k] == kind)
            *first = r->intake.sensors.first[k];
    }
    return r->intake.sensors.model + *first;
}

const struct nav_model *nav_record_rays(const struct nav_record *r)
{
    int first = 0;
    return record_models(r, &NAV_RANGE_MEASUREMENT, &first);
}

static void record_contacts(struct nav_record *r, const struct nav_evidence *e, float *cells)
{
    int range = 0, normal = 0;
    (void)record_models(r, &NAV_RANGE_MEASUREMENT, &range);
    (void)record_models(r, &NAV_NORMAL_MEASUREMENT, &normal);
    for (int ray = 0; ray < r->rays; ray++) {
        float *out = cells + (ptrdiff_t)PER_RAY * ray;
        bool read = e && e->weight[range + ray] > 0.0;
        bool directed = e && r->problem->robot.normals && e->weight[normal + ray] > 0.0;
        out[0] = read ? (float)e->reading[range + ray][0] : NAN;
        out[1] = read ? (float)e->weight[range + ray] : 0.0F;
        out[2] = directed ? (float)e->reading[normal + ray][0] : NAN;
        out[3] = directed ? (float)e->reading[normal + ray][1] : NAN;
    }
}

static void record_windows(struct nav_record *r, const struct nav_evidence *e, float *cells)
{
    int first = 0;
    (void)record_models(r, &NAV_TEXTURE_MEASUREMENT, &first);
    for (int tip = 0; tip < r->tips; tip++) {
        float *out = cells + (ptrdiff_t)tip * (1 + r->classes);
        struct nav_model *model = &r->intake.sensors.model[first + tip];
        double weight = e ? e->weight[first + tip] : 0.0;
        out[0] = -1.0F;
        if (!(weight > 0.0))
            continue;
        model->kind->fill(model, e->reading[first + tip], r->ratio);
        for (int k = 0; k < r->classes; k++)
            out[1 + k] = (float)pow(r->ratio[k], weight);
        out[0] = (float)r->moved[tip];
        r->moved[tip] = 0.0;
    }
}

long nav_record_take(struct nav_record *r, const struct nav_row *row)
{
    struct nav_motion motion;
    struct nav_evidence evidence;
    struct nav_settings settings = r->problem->settings;
    settings.motion.turn_rad = fmax(settings.motion.turn_rad, TURN_RAD);
    bool news = nav_intake_take(&r->intake, row, &motion, &evidence);
    struct nav_noise noise = nav_motion_noise(&r->problem->robot, &settings, &motion);
    long at = r->rows++;
    float *cells = r->cells + at % r->most * r->width;
    const double head[HEAD] = {motion.step.x, motion.step.y, motion.step.theta, noise.position, noise.heading};
    for (int n = 0; n < HEAD; n++)
        cells[n] = (float)head[n];
    for (int tip = 0; tip < r->tips; tip++)
        r->moved[tip] += hypot(motion.step.x, motion.step.y) +
                         hypot(r->problem->robot.tip[tip].x, r->problem->robot.tip[tip].y) * fabs(motion.step.theta);
    record_contacts(r, news ? &evidence : NULL, cells + HEAD);
    record_windows(r, news ? &evidence : NULL, cells + HEAD + (ptrdiff_t)PER_RAY * r->rays);
    return at;
}

bool nav_record_has(const struct nav_record *r, long row)
{
    return row >= 0 && row >= r->rows - r->most && row < r->rows;
}

struct nav_record_row nav_record_at(const struct nav_record *r, long row)
{
    const float *cells = r->cells + row % r->most * r->width;
    return (struct nav_record_row){
        .number = row,
        .step = {(double)cells[0], (double)cells[1], (double)cells[2]},
        .noise = {(double)cells[3], (double)cells[4]},
        .contact = (const struct nav_record_contact *)(const void *)(cells + HEAD),
        .window = cells + HEAD + (ptrdiff_t)PER_RAY * r->rays,
    };
}

bool nav_record_whole(const struct nav_record *r)
{
    return r->rows <= r->most;
}

size_t nav_record_bytes(const struct nav_record *r)
{
    return (size_t)r->most * (size_t)r->width * sizeof *r->cells;
}
