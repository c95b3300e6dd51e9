/* A sensor of the user's own: codes and likelihoods come from two functions (struct nav_sensor). */
#include <math.h>

#include "measurement.h"

static const double LEAST = 1e-6; /* of the mean likelihood: a reading of the user's model may be wrong, too */

static int own_count(const struct nav_robot *robot)
{
    return robot->sensors;
}

static int own_init(struct nav_model *model, const struct nav_arena *arena, const struct nav_robot *robot,
                    double blur_m)
{
    (void)arena;
    (void)blur_m;
    model->sensor = &robot->sensor[model->index];
    model->values = model->sensor->values;
    model->codes = model->sensor->codes + 1;
    model->spacing = model->sensor->spacing_m;
    model->detail = model->sensor->detail_m > 0.0 ? model->sensor->detail_m : (double)INFINITY;
    /* Where in a row its reading begins. */
    for (int n = 0; n < model->index; n++)
        model->first += robot->sensor[n].values;
    return 0;
}

static const double *own_cells(const struct nav_model *model, const struct nav_row *row)
{
    return row->own ? row->own + model->first : NULL;
}

/* Likelihoods by code into `out`; whether they can be used. */
static bool own_likelihood(const struct nav_model *model, const double *reading, double *out)
{
    double sum = 0.0;
    model->sensor->fill(model->sensor->self, reading, out);
    for (int k = 0; k < model->sensor->codes; k++) {
        if (!(out[k] >= 0.0))
            return false;
        sum += out[k];
    }
    return sum > 0.0 && isfinite(sum);
}

static enum nav_check own_check(const struct nav_model *model, const double *reading, uint64_t *bad)
{
    double likelihood[NAV_CODES_MOST];
    if (!reading || isnan(reading[0]))
        return NAV_NOT_READ;
    if (own_likelihood(model, reading, likelihood))
        return NAV_READ;
    *bad += 1;
    return NAV_BAD;
}

static double own_novelty(const struct nav_model *model, struct nav_track *track, struct nav_repeat *repeat,
                          const double *reading)
{
    (void)repeat;
    (void)reading;
    return nav_novelty(track->moved, model->spacing);
}

static bool own_sharp(const double *reading)
{
    (void)reading;
    return true;
}

static void own_expect(const struct nav_model *model, int count, const struct nav_arena *arena,
                       const struct nav_arena *near, const struct nav_place *at, uint8_t *codes)
{
    (void)arena;
    (void)near;
    for (int n = 0; n < count; n++) {
        const struct nav_sensor *sensor = model[n].sensor;
        int code = sensor->expect(sensor->self, at->x, at->y, atan2(at->s, at->c));
        codes[n] = (uint8_t)(code >= 0 && code < sensor->codes ? code : sensor->codes);
    }
}

static void own_fill(struct nav_model *model, const double *reading, double *ratio)
{
    double mean = 0.0;
    int codes = model->sensor->codes;
    bool usable = own_likelihood(model, reading, ratio); /* it was when it came; a function may answer otherwise now */
    for (int k = 0; k < codes; k++)
        mean += usable ? ratio[k] / codes : 0.0;
    for (int k = 0; k < codes; k++)
        ratio[k] = usable ? fmax(ratio[k] / mean, LEAST) : 1.0;
    ratio[codes] = 1.0;
}

const struct nav_measurement NAV_OWN_MEASUREMENT = {.name = "own",
                                                    .count = own_count,
                                                    .init = own_init,
                                                    .cells = own_cells,
                                                    .check = own_check,
                                                    .novelty = own_novelty,
                                                    .sharp = own_sharp,
                                                    .expect = own_expect,
                                                    .fill = own_fill};
