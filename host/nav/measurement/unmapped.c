#include "unmapped.h"

#include <math.h>
#include <stdlib.h>

int nav_unmapped_init(struct nav_unmapped *u, int states)
{
    *u = (struct nav_unmapped){.states = states};
    u->share = calloc((size_t)states + 1, sizeof *u->share);
    u->now = calloc((size_t)states + 1, sizeof *u->now);
    u->loglik = calloc((size_t)states + 1, sizeof *u->loglik);
    return u->share && u->now && u->loglik ? 0 : -1;
}

void nav_unmapped_free(struct nav_unmapped *u)
{
    free(u->share);
    free(u->now);
    free(u->loglik);
}

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

double nav_unmapped_take(struct nav_unmapped *u, double moved)
{
    double stays = exp(-moved / u->run_m), sum = 0.0;
    for (int k = 0; k < u->states; k++) {
        u->now[k] = (stays * u->now[k] + (1.0 - stays) * u->share[k]) * exp(u->loglik[k]);
        sum += u->now[k];
    }
    for (int k = 0; k < u->states; k++)
        u->now[k] /= sum;
    return log(sum);
}
