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

struct nav_detail nav_sensors_detail(const struct nav_sensors *s)
{
    struct nav_detail finest = {INFINITY, 0.0};
    for (int w = 0; w < s->count; w++) {
        const struct nav_model *model = &s->model[w];
        double lever = hypot(model->place.x, model->place.y);
        if (model->detail > finest.detail)
            continue;
        finest.lever = model->detail < finest.detail ? lever : fmax(lever, finest.lever);
        finest.detail = model->detail;
    }
    return finest;
}

double nav_sensors_reach(const struct nav_sensors *s, const struct nav_robot *robot)
{
    double reach = robot->body_radius;
    for (int w = 0; w < s->count; w++)
        if (s->model[w].reach > 0.0)
            reach = fmax(reach, hypot(s->model[w].place.x, s->model[w].place.y) + s->model[w].reach);
    return reach;
}
