/* Contact distances: noticed with a probability that falls off around the whisker's length, then Gaussian (the paper);
 * ghosts are spread evenly over the whisker; "no contact" is what is left over. A broken whisker's distances are taken
 * as ghosts are, 1 / length, and its silence as certain. */
#include "measurement.h"

#include <math.h>

static const double LEAST = 1e-30;
static const double FAR = 7.0; /* erfc(7) < 1e-22 */

/* Probability that an object at this distance makes a contact that is noticed: 1/2 (1 - miss) at the whisker's length.
 */
static double noticed(const struct nav_model *model, double distance)
{
    double beyond = (distance - model->length) / (model->edge * sqrt(2.0)), most = 1.0 - model->settings->radial_miss;
    if (beyond < -FAR)
        return most;
    return beyond > FAR ? 0.0 : most * 0.5 * erfc(beyond);
}

static double density(const struct nav_model *model, double difference)
{
    double z = difference / model->sigma;
    return fabs(z) > FAR * sqrt(2.0) ? 0.0 : exp(-0.5 * z * z) / (model->sigma * sqrt(8.0 * atan(1.0)));
}

void nav_mm_radial_begin(struct nav_model *model)
{
    for (int k = 0; k < model->codes; k++)
        model->noticed[k] = k == model->codes - 1 ? 0.0 : noticed(model, (k + 0.5) * model->step);
}

void nav_mm_radial(const struct nav_model *model, const double *reading, double *ratio)
{
    double ghost = model->settings->radial_ghost;
    for (int k = 0; k < model->codes; k++) {
        double hit = model->noticed[k];
        double p = (1.0 - hit) * (1.0 - ghost);
        if (isfinite(reading[0]))
            p = model->length * hit * density(model, reading[0] - (k + 0.5) * model->step) + (1.0 - hit) * ghost;
        ratio[k] = fmax(p, LEAST);
    }
}
