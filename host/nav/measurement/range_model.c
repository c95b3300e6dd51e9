/* Contact distances: noticed with a probability that falls off around the whisker's length, then Gaussian (the paper);
 * ghosts are spread evenly over the whisker; "no contact" is what is left over. A broken whisker's distances are taken
 * as ghosts are, 1 / length, and its silence as certain. */
#include "measurement.h"

#include <math.h>
#include <stdlib.h>

static const double FINEST_STEP_M = 0.001;
static const double LENGTH_SLACK = 1.5; /* a fitted line may answer a little more than the whisker's length */
static const double LEAST = 1e-30;
static const double FAR = 7.0; /* erfc(7) < 1e-22 */

/* Probability that an object at this distance makes a contact that is noticed: 1/2 (1 - miss) at the whisker's length.
 */
static double range_noticed(const struct nav_model *model, double distance)
{
    double beyond = (distance - model->length) / (model->edge * sqrt(2.0)), most = 1.0 - model->settings->radial.miss;
    if (beyond < -FAR)
        return most;
    return beyond > FAR ? 0.0 : most * 0.5 * erfc(beyond);
}

static double range_density(const struct nav_model *model, double difference)
{
    double z = difference / model->sigma;
    return fabs(z) > FAR * sqrt(2.0) ? 0.0 : exp(-0.5 * z * z) / (model->sigma * sqrt(8.0 * atan(1.0)));
}

static int range_count(const struct nav_robot *robot)
{
    return robot->rays;
}

/* Code for "nothing within reach". */
static int range_nothing(const struct nav_model *model)
{
    return model->codes - 2;
}

static int range_init(struct nav_model *model, const struct nav_arena *arena, const struct nav_robot *robot,
                      double blur_m)
{
    (void)arena;
    const struct nav_ray *ray = &robot->ray[model->index];
    model->values = 1;
    model->place.x = ray->x;
    model->place.y = ray->y;
    model->place.c = cos(ray->yaw);
    model->place.s = sin(ray->yaw);
    model->length = ray->length;
    model->detail = ray->length; /* from nothing within reach to touching at the root */
    model->spacing = model->settings->radial.spacing_m;
    model->sigma = hypot(robot->radial_sigma, blur_m);
    model->edge = hypot(model->settings->radial.edge_m, blur_m);
    double reach = model->length + 3.0 * model->edge;
    model->step = fmax(fmax(FINEST_STEP_M, model->sigma / 4.0), reach / (NAV_CODES_MOST - 3));
    model->codes = (int)ceil(reach / model->step) + 2;
    model->reach = range_nothing(model) * model->step;
    model->noticed = calloc((size_t)model->codes, sizeof *model->noticed);
    for (int k = 0; model->noticed && k < range_nothing(model); k++)
        model->noticed[k] = range_noticed(model, (k + 0.5) * model->step);
    return model->noticed ? 0 : -1;
}

static void range_free(struct nav_model *model)
{
    free(model->noticed);
}

static const double *range_cells(const struct nav_model *model, const struct nav_row *row)
{
    return row->radial_m + model->index;
}

static enum nav_check range_check(const struct nav_model *model, const double *distance, uint64_t *bad)
{
    if (isnan(*distance))
        return NAV_NOT_READ;
    if (*distance >= 0.0 && (isinf(*distance) || *distance <= LENGTH_SLACK * model->length))
        return NAV_READ;
    *bad += 1;
    return NAV_BAD;
}

/* That a contact begins or ends is new however little the whisker has moved. */
static double range_novelty(const struct nav_model *model, struct nav_track *track, struct nav_repeat *repeat,
                            const double *distance)
{
    (void)repeat;
    bool touching = isfinite(*distance) != 0, changed = touching != track->touching;
    track->touching = touching;
    return changed ? 1.0 : nav_novelty(track->moved, model->spacing);
}

static bool range_sharp(const double *distance)
{
    return isfinite(*distance) != 0;
}

static uint8_t range_code(const struct nav_model *model, double range)
{
    if (isnan(range))
        return (uint8_t)(model->codes - 1);
    double code = range / model->step;
    return (uint8_t)(code < range_nothing(model) ? (int)code : range_nothing(model));
}

static void range_expect(const struct nav_model *model, int count, const struct nav_arena *arena,
                         const struct nav_arena *near, const struct nav_place *at, uint8_t *codes)
{
    (void)arena;
    for (int r = 0; r < count; r++) {
        const struct nav_model *ray = &model[r];
        codes[r] = (uint8_t)range_nothing(ray);
        if (near)
            codes[r] = range_code(ray, nav_arena_range_along(near, nav_place_x(at, ray->place.x, ray->place.y),
                                                             nav_place_y(at, ray->place.x, ray->place.y),
                                                             at->c * ray->place.c - at->s * ray->place.s,
                                                             at->s * ray->place.c + at->c * ray->place.s, ray->reach));
    }
}

static void range_fill(struct nav_model *model, const double *reading, double *ratio)
{
    double ghost = model->settings->radial.ghost;
    for (int k = 0; k <= range_nothing(model); k++) {
        double hit = model->noticed[k];
        double p = (1.0 - hit) * (1.0 - ghost);
        if (isfinite(reading[0]))
            p = model->length * hit * range_density(model, reading[0] - (k + 0.5) * model->step) + (1.0 - hit) * ghost;
        ratio[k] = fmax(p, LEAST);
    }
    ratio[model->codes - 1] = 1.0;
}

double nav_range_unmapped(const struct nav_model *model, double distance, bool within)
{
    double ghost = model->settings->radial.ghost, hit = within ? 1.0 - model->settings->radial.miss : 0.0;
    return isfinite(distance) ? hit + (1.0 - hit) * ghost : (1.0 - hit) * (1.0 - ghost);
}

const struct nav_measurement NAV_RANGE_MEASUREMENT = {.name = "range",
                                                      .distance = true,
                                                      .solid = true,
                                                      .count = range_count,
                                                      .init = range_init,
                                                      .free = range_free,
                                                      .cells = range_cells,
                                                      .check = range_check,
                                                      .novelty = range_novelty,
                                                      .sharp = range_sharp,
                                                      .expect = range_expect,
                                                      .fill = range_fill};
