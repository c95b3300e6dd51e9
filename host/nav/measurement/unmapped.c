#include "unmapped.h"

#include <math.h>

void nav_unmapped_count(struct nav_unmapped *u, int state, double weight)
{
    u->share[state] += weight;
}

void nav_unmapped_begin(struct nav_unmapped *u, double run_m)
{
    double total = 0.0;
    u->run_m = run_m;
    for (int k = 0; k < u->states; k++)
        total += u->share[k];
    for (int k = 0; k < u->states; k++)
        u->now[k] = u->share[k] /= total;
}

double nav_unmapped_take(struct nav_unmapped *u, double moved, const double *loglik)
{
    double stays = exp(-moved / u->run_m), sum = 0.0;
    for (int k = 0; k < u->states; k++) {
        u->now[k] = (stays * u->now[k] + (1.0 - stays) * u->share[k]) * exp(loglik[k]);
        sum += u->now[k];
    }
    for (int k = 0; k < u->states; k++)
        u->now[k] /= sum;
    return log(sum);
}
