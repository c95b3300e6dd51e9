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
static const double GAP_STEP = 0.05; /* of the running median's logarithm, per window */

/* The gap at which a softmax gives its best class the share that makes the whole model `accuracy` sure. */
static double wanted_gap(const struct nav_model *model)
{
    double classes = model->codes, outlier = model->settings->texture_outlier;
    double sure = (model->accuracy - outlier / classes) / fmax(1.0 - outlier, 1e-6), chance = 1.0 / classes;
    sure = chance + (1.0 - chance) * fmin(fmax((sure - chance) / (1.0 - chance), SURE_LEAST), SURE_MOST);
    return log((classes - 1.0) * sure / (1.0 - sure));
}

void nav_mm_texture_begin(struct nav_model *model)
{
    model->accuracy = ASSUMED_ACCURACY;
    model->gap = 0.0;
    model->temper = model->settings->texture_temper;
}

static double gap_of(const double *reading, int classes)
{
    double best = -INFINITY, second = -INFINITY;
    for (int k = 0; k < classes; k++) {
        second = fmax(second, fmin(reading[k], best));
        best = fmax(best, reading[k]);
    }
    return best - second;
}

void nav_mm_texture_watch(struct nav_model *model, const double *reading)
{
    if (model->settings->texture_temper > 0.0 || model->codes < 2)
        return;
    double gap = gap_of(reading, model->codes);
    if (gap > GAP_LEAST && model->gap <= 0.0)
        model->gap = gap;
    else if (gap > GAP_LEAST && gap != model->gap)
        model->gap *= gap > model->gap ? exp(GAP_STEP) : exp(-GAP_STEP);
    model->temper = fmin(wanted_gap(model) / fmax(model->gap, GAP_LEAST), 1.0);
}

void nav_mm_texture(const struct nav_model *model, const double *reading, double *ratio)
{
    double temper = model->temper, outlier = model->settings->texture_outlier;
    double best = reading[0], total = 0.0;
    for (int k = 1; k < model->codes; k++)
        best = fmax(best, reading[k]);
    for (int k = 0; k < model->codes; k++)
        total += exp(temper * (reading[k] - best));
    for (int k = 0; k < model->codes; k++) {
        double share = exp(temper * (reading[k] - best)) / total;
        double p = (1.0 - outlier) * share + outlier / model->codes;
        ratio[k] = fmax(p, 1e-30) * model->codes;
    }
}
