#include "adaptive_kidnap.h"

#include <math.h>
#include <stdlib.h>

/* Poses from which the shares of codes are counted, and draws that may miss free space for each. */
enum { POSES = 4096, TRIES = 16 };

static struct nav_pose kidnap_draw(const struct nav_likelihood *l, struct nav_rng *rng)
{
    struct nav_pose pose = {0.0, 0.0, 0.0};
    for (int n = 0; n < TRIES; n++) {
        pose = (struct nav_pose){l->arena->size_x * nav_rng_uniform(rng), l->arena->size_y * nav_rng_uniform(rng),
                                 2.0 * NAV_PI * nav_rng_uniform(rng)};
        double prior = nav_likelihood_clear(l, pose.x, pose.y, 0.0) ? nav_likelihood_prior(l, pose.x, pose.y) : 0.0;
        if (prior >= 1.0 || (prior > 0.0 && nav_rng_uniform(rng) < prior))
            break;
    }
    return pose;
}

/* States of what a sensor meets: textures; nothing and something within reach. A sensor of another kind meets another
 * thing each time: one state. */
static int kidnap_states(const struct nav_model *model)
{
    return model->kind->floor ? model->codes : model->kind->distance ? 2 : 1;
}

static int kidnap_state(const struct nav_model *model, int code)
{
    return model->kind->floor ? code : model->kind->distance ? code < model->codes - 2 : 0;
}

/* Path over which one thing stays at a sensor, as where nothing is mapped (likelihood.c). */
static double kidnap_run_m(const struct nav_likelihood *l, int w)
{
    return l->model[w].kind->floor ? NAV_PI * l->arena->tile / 4.0 : l->model[w].length;
}

static void kidnap_count(struct adaptive_kidnap *d, struct nav_likelihood *l, struct nav_rng *rng)
{
    for (int n = 0; n < POSES; n++) {
        struct nav_pose pose = kidnap_draw(l, rng);
        nav_likelihood_expect(l, &(struct nav_place){pose.x, pose.y, cos(pose.theta), sin(pose.theta)}, l->scratch);
        for (int w = 0; w < d->whiskers; w++)
            d->share[w][l->scratch[w]] += 1.0f / POSES;
    }
    for (int w = 0; w < d->whiskers; w++) {
        for (int k = 0; k < l->model[w].codes; k++)
            nav_unmapped_count(&d->any[w], kidnap_state(&l->model[w], k), (double)d->share[w][k]);
    }
}

int adaptive_kidnap_init(struct adaptive_kidnap *d, struct nav_likelihood *l, struct nav_rng *rng)
{
    *d = (struct adaptive_kidnap){.whiskers = l->whiskers};
    d->share = calloc((size_t)l->whiskers + 1, sizeof *d->share);
    d->any = calloc((size_t)l->whiskers + 1, sizeof *d->any);
    d->trust = calloc((size_t)l->whiskers + 1, sizeof *d->trust);
    for (int w = 0; d->share && d->any && w < l->whiskers; w++) {
        d->share[w] = calloc((size_t)l->model[w].codes, sizeof **d->share);
        if (!d->share[w] || nav_unmapped_init(&d->any[w], kidnap_states(&l->model[w])))
            return -1;
    }
    if (!d->share || !d->any || !d->trust)
        return -1;
    kidnap_count(d, l, rng);
    adaptive_kidnap_clear(d, l, 0);
    return 0;
}

void adaptive_kidnap_free(struct adaptive_kidnap *d)
{
    for (int w = 0; d->share && w < d->whiskers; w++)
        free(d->share[w]);
    for (int w = 0; d->any && w < d->whiskers; w++)
        nav_unmapped_free(&d->any[w]);
    free(d->share);
    free(d->any);
    free(d->trust);
}

/* Log-likelihoods of the reading by state: the mean of its codes, as often as they are met. */
static void kidnap_read(const struct adaptive_kidnap *d, const struct nav_likelihood *l, int w)
{
    const struct nav_model *model = &l->model[w];
    struct nav_unmapped *any = &d->any[w];
    for (int k = 0; k < any->states; k++)
        any->loglik[k] = 0.0;
    for (int k = 0; k < model->codes; k++) {
        if (d->share[w][k] > 0.0f) /* ratios to a broken whisker */
            any->loglik[kidnap_state(model, k)] += (double)d->share[w][k] * l->ratio[w][k];
    }
    for (int k = 0; k < any->states; k++) {
        double ratio = any->share[k] > 0.0 ? any->loglik[k] / any->share[k] : 1.0;
        any->loglik[k] = l->weight[w] * log(d->trust[w] * ratio + 1.0 - d->trust[w]);
    }
}

double adaptive_kidnap_anywhere(struct adaptive_kidnap *d, const struct nav_likelihood *l, const double *moved)
{
    double sum = 0.0;
    for (int w = 0; w < d->whiskers; w++) {
        if (!(l->weight[w] > 0.0))
            continue;
        kidnap_read(d, l, w);
        sum += nav_unmapped_take(&d->any[w], moved[w]);
    }
    return sum;
}

void adaptive_kidnap_take(struct adaptive_kidnap *d, const struct nav_likelihood *l, uint64_t row, double anywhere,
                          double local)
{
    d->ratio += anywhere - local;
    d->proven = fmax(d->proven + local - anywhere, 0.0);
    if (!(d->ratio > 0.0))
        adaptive_kidnap_clear(d, l, row + 1);
}

void adaptive_kidnap_clear(struct adaptive_kidnap *d, const struct nav_likelihood *l, uint64_t row)
{
    d->ratio = 0.0;
    d->since = row;
    for (int w = 0; w < d->whiskers; w++) {
        d->trust[w] = l->trust[w].working;
        nav_unmapped_begin(&d->any[w], kidnap_run_m(l, w));
    }
}

void adaptive_kidnap_teach(const struct adaptive_kidnap *d, const struct nav_likelihood *from,
                           struct nav_likelihood *to)
{
    for (int w = 0; w < d->whiskers; w++) {
        to->trust[w].working = d->trust[w];
        to->model[w].temper = from->model[w].temper;
        to->model[w].gap = from->model[w].gap;
        to->model[w].accuracy = from->model[w].accuracy;
    }
}
