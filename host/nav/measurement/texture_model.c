/* Texture windows: p(window | texture k) ~ (1 - outlier) softmax(temper * LL)_k + outlier / classes.
 *
 * A classifier's log-likelihoods may be sums over 200 correlated samples, hundreds of nats apart, or calibrated. The
 * automatic temper makes the median window as sure as windows are right: its best class gets the probability `accuracy`
 * (first assumed, then learned from how a confident belief agrees: trust.h). */
#include "measurement.h"

#include <math.h>

static const double ASSUMED_ACCURACY = 0.87;
static const double SURE_MOST = 0.98, SURE_LEAST = 0.05; /* of the softmax at the median gap, beyond chance */
static const double GAP_LEAST = 1e-9;
static const double LOGLIK_MOST = 1e9;
/* Share of a tile after which a window is new, whatever the setting: on small tiles every reading is another one's. */
static const double FRESH = 1.0 / 6.0;
static const double GAP_STEP = 0.05; /* of the running median's logarithm, per window */

/* The gap at which a softmax gives its best class the share that makes the whole model `accuracy` sure. */
static double texture_wanted_gap(const struct nav_model *model)
{
    double classes = model->values, outlier = model->settings->texture.outlier;
    double sure = (model->accuracy - outlier / classes) / fmax(1.0 - outlier, 1e-6), chance = 1.0 / classes;
    sure = chance + (1.0 - chance) * fmin(fmax((sure - chance) / (1.0 - chance), SURE_LEAST), SURE_MOST);
    return log((classes - 1.0) * sure / (1.0 - sure));
}

static int texture_count(const struct nav_robot *robot)
{
    return robot->tips;
}

static int texture_init(struct nav_model *model, const struct nav_arena *arena, const struct nav_robot *robot,
                        double blur_m)
{
    (void)blur_m;
    model->values = arena->classes;
    model->codes = arena->classes + 1;
    model->place.x = robot->tip[model->index].x;
    model->place.y = robot->tip[model->index].y;
    model->detail = arena->classes > 1 ? arena->tile : (double)INFINITY;
    model->spacing = fmin(model->settings->texture.spacing_m, FRESH * model->detail);
    model->accuracy = ASSUMED_ACCURACY;
    model->temper = model->settings->texture.temper;
    return 0;
}

static const double *texture_cells(const struct nav_model *model, const struct nav_row *row)
{
    return row->texture + model->index * model->values;
}

static bool texture_says_nothing(const double *loglik, int classes)
{
    for (int k = 1; k < classes; k++) {
        if (loglik[k] != loglik[0])
            return false;
    }
    return classes > 1;
}

static enum nav_check texture_check(const struct nav_model *model, const double *loglik, uint64_t *bad)
{
    uint64_t before = *bad;
    if (isnan(loglik[0]))
        return NAV_NOT_READ;
    for (int k = 0; k < model->values; k++)
        *bad += !(fabs(loglik[k]) <= LOGLIK_MOST);
    if (*bad != before)
        return NAV_BAD;
    return texture_says_nothing(loglik, model->values) ? NAV_EMPTY : NAV_READ;
}

/* That a whisker has hardly moved and that errors repeat are two accounts of one thing: the stronger one counts. */
static double texture_novelty(const struct nav_model *model, struct nav_track *track, struct nav_repeat *repeat,
                              const double *loglik)
{
    double weight = nav_novelty(track->moved, model->spacing);
    int best = 0;
    if (!(weight > 0.0))
        return weight;
    for (int k = 1; k < model->values; k++)
        best = loglik[k] > loglik[best] ? k : best;
    double expected = track->expected;
    track->expected = 0.0;
    return fmin(weight, nav_repeat_take(repeat, model->index, best, track->moved, expected));
}

static bool texture_sharp(const double *reading)
{
    (void)reading;
    return false;
}

static void texture_expect(const struct nav_model *model, int count, const struct nav_arena *arena,
                           const struct nav_arena *near, const struct nav_place *at, uint8_t *codes)
{
    (void)near;
    for (int t = 0; t < count; t++) {
        const struct nav_model *tip = &model[t];
        int texture = nav_arena_texture(arena, nav_place_x(at, tip->place.x, tip->place.y),
                                        nav_place_y(at, tip->place.x, tip->place.y));
        codes[t] = (uint8_t)(texture < tip->values ? texture : tip->values);
    }
}

static double texture_gap(const double *reading, int classes)
{
    double best = -INFINITY, second = -INFINITY;
    for (int k = 0; k < classes; k++) {
        second = fmax(second, fmin(reading[k], best));
        best = fmax(best, reading[k]);
    }
    return best - second;
}

/* Notes a window's spread and sets the temper for it. A fixed temper (setting above 0) stays as it is. */
static void texture_watch(struct nav_model *model, const double *reading)
{
    if (model->settings->texture.temper > 0.0 || model->values < 2)
        return;
    double gap = texture_gap(reading, model->values);
    if (gap > GAP_LEAST && model->gap <= 0.0)
        model->gap = gap;
    else if (gap > GAP_LEAST && gap != model->gap)
        model->gap *= gap > model->gap ? exp(GAP_STEP) : exp(-GAP_STEP);
    model->temper = fmin(texture_wanted_gap(model) / fmax(model->gap, GAP_LEAST), 1.0);
}

static void texture_fill(struct nav_model *model, const double *reading, double *ratio)
{
    texture_watch(model, reading);
    double temper = model->temper, outlier = model->settings->texture.outlier;
    double best = reading[0], total = 0.0;
    for (int k = 1; k < model->values; k++)
        best = fmax(best, reading[k]);
    for (int k = 0; k < model->values; k++)
        total += exp(temper * (reading[k] - best));
    for (int k = 0; k < model->values; k++) {
        double share = exp(temper * (reading[k] - best)) / total;
        double p = (1.0 - outlier) * share + outlier / model->values;
        ratio[k] = fmax(p, 1e-30) * model->values;
    }
    ratio[model->values] = 1.0;
}

const struct nav_measurement NAV_TEXTURE_MEASUREMENT = {.name = "texture",
                                                        .floor = true,
                                                        .count = texture_count,
                                                        .init = texture_init,
                                                        .cells = texture_cells,
                                                        .check = texture_check,
                                                        .novelty = texture_novelty,
                                                        .sharp = texture_sharp,
                                                        .expect = texture_expect,
                                                        .fill = texture_fill};
