#include "measurement.h"

#include <math.h>
#include <stdlib.h>

const struct nav_measurement *const NAV_MEASUREMENTS[NAV_KINDS] = {
    &NAV_TEXTURE_MEASUREMENT,
    &NAV_RANGE_MEASUREMENT,
    &NAV_NORMAL_MEASUREMENT,
    &NAV_OWN_MEASUREMENT,
};

int nav_sensors_init(struct nav_sensors *s, const struct nav_arena *arena, const struct nav_robot *robot,
                     const struct nav_settings *settings, double blur_m)
{
    *s = (struct nav_sensors){.count = 0};
    for (int k = 0; k < NAV_KINDS; k++)
        s->first[k + 1] = s->first[k] + NAV_MEASUREMENTS[k]->count(robot);
    s->model = calloc((size_t)s->first[NAV_KINDS] + 1, sizeof *s->model);
    for (int k = 0; s->model && k < NAV_KINDS; k++) {
        for (; s->count < s->first[k + 1]; s->count++) {
            struct nav_model *model = &s->model[s->count];
            *model = (struct nav_model){.kind = NAV_MEASUREMENTS[k],
                                        .settings = settings,
                                        .index = s->count - s->first[k],
                                        .place.c = 1.0,
                                        .detail = INFINITY};
            if (model->kind->init(model, arena, robot, blur_m))
                return -1;
        }
    }
    return s->model ? 0 : -1;
}

void nav_sensors_free(struct nav_sensors *s)
{
    for (int w = 0; s->model && w < s->first[NAV_KINDS]; w++) {
        if (s->model[w].kind && s->model[w].kind->free)
            s->model[w].kind->free(&s->model[w]);
    }
    free(s->model);
}

double nav_model_lever(const struct nav_model *model)
{
    return hypot(model->place.x + model->length * model->place.c, model->place.y + model->length * model->place.s);
}

/* As NAV_EDGE_MOST_M. */
static const double HEADING_MOST = NAV_NEAR_RAD / 3.0;

/* Least that a user may ask for, m, and rad: finer cells fill any memory. */
static const double EDGE_LEAST_M = 0.005, HEADING_LEAST = NAV_PI / 90.0;

/* A heading's cell may move the sensor by this share of a cell's edge. */
static const double TURN_SHARE = 2.0 / 3.0;

struct nav_cell nav_sensors_cell(const struct nav_sensors *s, double edge_m)
{
    double finest = INFINITY;
    struct nav_cell cell = {.pattern = INFINITY};
    for (int w = 0; w < s->count; w++) {
        const struct nav_model *model = &s->model[w];
        double lever = nav_model_lever(model);
        cell.pattern = model->kind->distance ? cell.pattern : fmin(cell.pattern, model->detail);
        if (model->detail > finest)
            continue;
        cell.lever = model->detail < finest ? lever : fmax(lever, cell.lever);
        finest = model->detail;
    }
    cell.edge = fmax(edge_m > 0.0 ? edge_m : fmin(NAV_EDGE_MOST_M, finest / 2.0), EDGE_LEAST_M);
    cell.heading = fmax(fmin(HEADING_MOST, TURN_SHARE * cell.edge / fmax(cell.lever, EDGE_LEAST_M)), HEADING_LEAST);
    return cell;
}

int nav_problem_cell(const struct nav_problem *problem, double edge_m, struct nav_cell *cell)
{
    struct nav_sensors sensors;
    int failed = nav_sensors_init(&sensors, &problem->arena, &problem->robot, &problem->settings, 0.0);
    *cell = nav_sensors_cell(&sensors, edge_m);
    nav_sensors_free(&sensors);
    return failed;
}

int nav_cell_headings(const struct nav_cell *cell)
{
    return (int)ceil(2.0 * NAV_PI / cell->heading - 1e-6);
}

double nav_cell_blur(double edge, double heading, double lever, int sub, int turns)
{
    return hypot(edge / sub, lever * heading / turns) / sqrt(12.0); /* uniform: width / root of 12 */
}

double nav_sensors_reach(const struct nav_sensors *s, const struct nav_robot *robot)
{
    double reach = robot->body_radius;
    for (int w = 0; w < s->count; w++)
        if (s->model[w].reach > 0.0)
            reach = fmax(reach, hypot(s->model[w].place.x, s->model[w].place.y) + s->model[w].reach);
    return reach;
}
