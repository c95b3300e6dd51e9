#include "texture_filter.h"

#include <math.h>
#include <string.h>

#define TINY 1e-300 /* keeps a sum of probabilities above 0 where the likeliest class has none */

void nav_texture_filter_start(double *posterior, int classes)
{
    for (int k = 0; k < classes; k++)
        posterior[k] = 1.0 / classes;
}

void nav_texture_filter_change(double *posterior, int classes, double chance)
{
    for (int k = 0; k < classes && classes > 1; k++)
        posterior[k] = (1.0 - chance) * posterior[k] + chance * (1.0 - posterior[k]) / (classes - 1);
}

void nav_texture_filter_weigh(double *posterior, int classes, const double *loglik, double temper)
{
    double sum = 0.0;
    for (int k = 0; k < classes; k++)
        sum += posterior[k] = posterior[k] * exp(temper * loglik[k]) + TINY;
    for (int k = 0; k < classes; k++)
        posterior[k] /= sum;
}

void nav_texture_filter_run(const double *loglik, size_t rows, int classes, double temper, double chance,
                            double *posterior)
{
    for (size_t i = 0; i < rows; i++, loglik += classes, posterior += classes) {
        if (i == 0)
            nav_texture_filter_start(posterior, classes);
        else
            memcpy(posterior, posterior - classes, (size_t)classes * sizeof *posterior);
        nav_texture_filter_change(posterior, classes, chance);
        nav_texture_filter_weigh(posterior, classes, loglik, temper);
    }
}
