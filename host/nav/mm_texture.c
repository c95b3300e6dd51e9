/* Texture windows: p(window | texture k) ~ (1 - outlier) softmax(temper * LL)_k + outlier / classes. */
#include "measurement.h"

#include <math.h>

void nav_mm_texture(const struct nav_model *model, const double *reading, double weight, float *loglik)
{
    double temper = model->settings->texture_temper, outlier = model->settings->texture_outlier;
    double best = reading[0], total = 0.0;
    for (int k = 1; k < model->codes; k++)
        best = fmax(best, reading[k]);
    for (int k = 0; k < model->codes; k++)
        total += exp(temper * (reading[k] - best));
    for (int k = 0; k < model->codes; k++) {
        double share = exp(temper * (reading[k] - best)) / total;
        double p = (1.0 - outlier) * share + outlier / model->codes;
        loglik[k] = (float)(weight * log(fmax(p, 1e-30)));
    }
}
