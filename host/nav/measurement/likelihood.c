#include "likelihood.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "unmapped.h"

/* Cells from which contacts are counted, of an arena with ground that was never mapped: a share of a tenth is then
 * known to a twentieth of itself. */
enum { SURVEYED = 40000 };

/* States of a sensor of distances where nothing is mapped. */
enum { NOTHING, SOMETHING };

/* Of a sensor of the floor what may lie under it is a texture; of one that measures distances, where some ground is not
 * mapped, nothing or something within its reach. */
static int likelihood_unmapped(struct nav_likelihood *l, int w)
{
    const struct nav_arena *arena = l->arena;
    const struct nav_model *model = &l->model[w];
    struct nav_unmapped *u = &l->unmapped[w];
    if (nav_unmapped_init(u, model->kind->floor                            ? model->codes - 1
                             : model->kind->distance && arena->unknown > 0 ? 2
                                                                           : 0))
        return -1;
    for (int k = 0; k < u->states; k++)
        nav_unmapped_count(u, k, 1.0); /* each as if seen once more */
    for (int n = 0; model->kind->floor && n < arena->columns * arena->rows; n++) {
        if (arena->floor[n] < u->states)
            nav_unmapped_count(u, arena->floor[n], 1.0);
    }
    /* A line leaves a square tile after pi/4 of its edge, on average (Cauchy). */
    nav_unmapped_begin(u, model->kind->floor ? NAV_PI * arena->tile / 4.0 : model->length);
    return 0;
}

static int likelihood_tables(struct nav_likelihood *l)
{
    for (int w = 0; w < l->whiskers; w++) {
        size_t codes = (size_t)l->model[w].codes;
        l->table[w] = calloc(codes, sizeof **l->table);
        l->ratio[w] = calloc(codes, sizeof **l->ratio);
        if (!l->table[w] || !l->ratio[w] || nav_trust_init(&l->trust[w], (int)codes) || likelihood_unmapped(l, w))
            return -1;
    }
    return 0;
}

/* Counts contacts that are not missed from the mapped cells of the ground, at headings that have nothing to do with one
 * another. */
static void likelihood_survey(struct nav_likelihood *l)
{
    const double golden = NAV_PI * (3.0 - sqrt(5.0));
    const struct nav_ground *g = &l->ground;
    for (int w = 0; w < l->whiskers; w++) {
        struct nav_model *model = &l->model[w];
        double within = 1.0 - model->settings->radial.miss;
        if (!model->kind->distance || l->unmapped[w].states == 0)
            continue;
        for (int n = 0; n < g->columns * g->rows; n += 1 + g->columns * g->rows / SURVEYED) {
            struct nav_place at = {(n % g->columns + 0.5) / g->per_m, (n / g->columns + 0.5) / g->per_m,
                                   cos(golden * n), sin(golden * n)};
            struct nav_arena near;
            uint8_t code;
            if (g->state[n] != NAV_GROUND_MAPPED)
                continue;
            bool any = nav_obstacles_near(&l->obstacles, at.x, at.y, &near);
            model->kind->expect(model, 1, l->arena, any ? &near : NULL, &at, &code);
            if (code == model->codes - 1)
                continue;
            nav_unmapped_count(&l->unmapped[w], NOTHING, 1.0 - model->noticed[code] / within);
            nav_unmapped_count(&l->unmapped[w], SOMETHING, model->noticed[code] / within);
        }
        nav_unmapped_begin(&l->unmapped[w], model->length);
    }
}

struct nav_likelihood *nav_likelihood_new(const struct nav_arena *arena, const struct nav_robot *robot,
                                          const struct nav_settings *settings, double blur_m)
{
    struct nav_likelihood *l = calloc(1, sizeof *l);
    if (!l)
        return NULL;
    l->arena = arena;
    l->robot = robot;
    int failed = nav_sensors_init(&l->sensors, arena, robot, settings, blur_m);
    size_t whiskers = (size_t)l->sensors.count + 1;
    l->whiskers = l->sensors.count;
    l->model = l->sensors.model;
    l->table = calloc(whiskers, sizeof *l->table);
    l->ratio = calloc(whiskers, sizeof *l->ratio);
    l->weight = calloc(whiskers, sizeof *l->weight);
    l->trust = calloc(whiskers, sizeof *l->trust);
    l->unmapped = calloc(whiskers, sizeof *l->unmapped);
    l->unknown = calloc(whiskers, sizeof *l->unknown);
    l->scratch = calloc(whiskers, 1);
    l->read = calloc(whiskers, sizeof *l->read);
    failed = nav_map_init(&l->map, arena, whiskers) || failed;
    if (failed || !l->scratch || !l->read || !l->table || !l->ratio || !l->weight || !l->trust || !l->unmapped ||
        !l->unknown || likelihood_tables(l) ||
        nav_obstacles_init(&l->obstacles, arena, nav_sensors_reach(&l->sensors, robot)) ||
        nav_ground_init(&l->ground, &l->obstacles, robot->body_radius)) {
        nav_likelihood_free(l);
        return NULL;
    }
    likelihood_survey(l);
    return l;
}

void nav_likelihood_free(struct nav_likelihood *l)
{
    if (!l)
        return;
    for (int w = 0; w < l->whiskers; w++) {
        free(l->table ? l->table[w] : NULL);
        free(l->ratio ? l->ratio[w] : NULL);
        if (l->trust)
            nav_trust_free(&l->trust[w]);
        if (l->unmapped)
            nav_unmapped_free(&l->unmapped[w]);
    }
    nav_sensors_free(&l->sensors);
    nav_obstacles_free(&l->obstacles);
    nav_ground_free(&l->ground);
    nav_map_free(&l->map);
    free(l->table);
    free(l->ratio);
    free(l->trust);
    free(l->unmapped);
    free(l->unknown);
    free(l->weight);
    free(l->scratch);
    free(l->read);
    free(l);
}

/* Logarithm of a reading's likelihood, by that of a broken sensor. */
static double likelihood_log(const struct nav_likelihood *l, int w, double ratio)
{
    double trust = l->trust[w].working;
    return l->weight[w] * log(trust * ratio + 1.0 - trust);
}

/* The same where nothing is mapped, and the ratio that would give it. */
static void likelihood_read_unknown(struct nav_likelihood *l, int w, const struct nav_evidence *evidence)
{
    struct nav_unmapped *u = &l->unmapped[w];
    const struct nav_model *model = &l->model[w];
    double trust = l->trust[w].working;
    if (evidence->unknown) {
        l->unknown[w] = evidence->unknown[w];
    } else {
        for (int k = 0; k < u->states; k++)
            u->loglik[k] =
                model->kind->distance
                    ? likelihood_log(l, w, nav_range_unmapped(model, evidence->reading[w][0], k == SOMETHING))
                    : (double)l->table[w][k];
        l->unknown[w] = nav_unmapped_take(u, evidence->moved ? evidence->moved[w] : (double)INFINITY);
    }
    l->table[w][model->codes - 1] = (float)l->unknown[w];
    l->ratio[w][model->codes - 1] = fmax((exp(l->unknown[w] / l->weight[w]) - (1.0 - trust)) / trust, 0.0);
}

static void likelihood_read_one(struct nav_likelihood *l, int w, const struct nav_evidence *evidence)
{
    struct nav_model *model = &l->model[w];
    double *ratio = l->ratio[w];
    model->kind->fill(model, evidence->reading[w], ratio);
    for (int k = 0; k < model->codes; k++)
        l->table[w][k] = (float)likelihood_log(l, w, ratio[k]);
    if (l->unmapped[w].states > 0)
        likelihood_read_unknown(l, w, evidence);
}

static double likelihood_best(const float *table, int codes)
{
    float best = table[0];
    for (int k = 1; k < codes; k++)
        best = table[k] > best ? table[k] : best;
    return (double)best;
}

void nav_likelihood_read(struct nav_likelihood *l, const struct nav_evidence *evidence)
{
    l->ceiling = 0.0;
    l->reads = 0;
    l->reading = evidence->reading;
    l->track = evidence->track;
    for (int k = 0; k < NAV_KINDS; k++) {
        l->active[k] = false;
        for (int w = l->sensors.first[k]; w < l->sensors.first[k + 1]; w++) {
            l->weight[w] = evidence->weight[w];
            if (l->weight[w] > 0.0) {
                likelihood_read_one(l, w, evidence);
                l->active[k] = true;
                l->read[l->reads++] = w;
                l->ceiling += likelihood_best(l->table[w], l->model[w].codes);
            } else {
                memset(l->table[w], 0, (size_t)l->model[w].codes * sizeof **l->table);
            }
        }
    }
}

/* Codes at a place, 0 for kinds that are not wanted; NULL: all are. */
static void likelihood_expect(const struct nav_likelihood *l, const struct nav_place *at, const bool *wanted,
                              uint8_t *codes)
{
    struct nav_arena near;
    for (int k = 0; k < NAV_KINDS; k++) {
        const struct nav_measurement *kind = NAV_MEASUREMENTS[k];
        int first = l->sensors.first[k], count = l->sensors.first[k + 1] - first;
        if (count == 0)
            continue;
        bool asked = !wanted || wanted[k];
        bool any = asked && kind->solid && nav_obstacles_near(&l->obstacles, at->x, at->y, &near);
        if (asked)
            kind->expect(l->model + first, count, &l->map.arena, any ? &near : NULL, at, codes + first);
        else
            memset(codes + first, 0, (size_t)count);
    }
}

void nav_likelihood_expect(const struct nav_likelihood *l, const struct nav_place *at, uint8_t *codes)
{
    likelihood_expect(l, at, NULL, codes);
}

bool nav_likelihood_clear(const struct nav_likelihood *l, double x, double y, double grace)
{
    return nav_obstacles_clear(&l->obstacles, x, y, fmax(l->robot->body_radius - grace, 0.0)) &&
           nav_likelihood_prior(l, x, y) > 0.0;
}

double nav_likelihood_prior(const struct nav_likelihood *l, double x, double y)
{
    return nav_ground_prior(&l->ground, &l->obstacles, x, y);
}

float nav_likelihood_at(const struct nav_likelihood *l, const struct nav_place *at, uint8_t *codes)
{
    float sum = 0.0f;
    likelihood_expect(l, at, l->active, codes);
    if (l->map.things > 0)
        nav_map_apply(l, at, codes);
    for (int n = 0; n < l->reads; n++)
        sum += l->table[l->read[n]][codes[l->read[n]]];
    return sum;
}

double nav_likelihood_standing(const struct nav_likelihood *l, const struct nav_place *at)
{
    if (!nav_likelihood_clear(l, at->x, at->y, 0.0))
        return -INFINITY;
    return (double)nav_likelihood_at(l, at, l->scratch);
}

size_t nav_likelihood_bytes(const struct nav_likelihood *l)
{
    size_t bytes = nav_obstacles_bytes(&l->obstacles) + nav_map_bytes(&l->map);
    for (int w = 0; w < l->whiskers; w++)
        bytes += (size_t)l->model[w].codes * (sizeof **l->table + 3 * sizeof **l->ratio) + sizeof *l->model;
    return bytes;
}
