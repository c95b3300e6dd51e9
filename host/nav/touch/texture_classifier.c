#include "texture_classifier.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "rng.h"
#include "texture_features.h"
#include "texture_own.h"

struct nav_texture_classifier {
    struct nav_texture_classifier_numbers n; /* its arrays are the classifier's own */
    int features;
    struct nav_texture_features *reduce;
    float *projection; /* [F][H]: a row per feature, so that the inner loop runs over neighbours; single precision
                          is finer than any feature and twice as fast */
    float *projected;  /* [H] */
    double *threshold; /* [H] */
    double *expanded;  /* [F + H] */
};

static bool numbers_ok(const struct nav_texture_classifier_numbers *n)
{
    return n->classes >= 1 && n->classes <= NAV_TEXTURE_CLASSES_MAX && n->hidden >= 0 &&
           n->hidden <= NAV_TEXTURE_HIDDEN_MAX && isfinite(n->temper) && n->temper >= 0.0;
}

static bool own_arrays(struct nav_texture_classifier *r)
{
    size_t f = (size_t)r->features, k = (size_t)r->n.classes, h = (size_t)r->n.hidden;
    bool ok = nav_texture_own(&r->n.floor, (size_t)r->n.channels);
    ok = nav_texture_own(&r->n.centre, f) && ok;
    ok = nav_texture_own(&r->n.scale, f) && ok;
    ok = nav_texture_own(&r->n.weight, (f + h) * k) && ok;
    ok = nav_texture_own(&r->n.bias, k) && ok;
    return ok;
}

/* Directions of unit mean square on standardised features; thresholds spread as the projections are. */
static bool make_projections(struct nav_texture_classifier *r)
{
    size_t f = (size_t)r->features, h = (size_t)r->n.hidden;
    r->projection = calloc(f * h + 1, sizeof *r->projection);
    r->projected = calloc(h + 1, sizeof *r->projected);
    r->threshold = calloc(h + 1, sizeof *r->threshold);
    if (!r->projection || !r->projected || !r->threshold)
        return false;
    struct nav_rng rng;
    nav_rng_seed(&rng, r->n.seed, 0);
    for (size_t i = 0; i < h; i++) { /* unit by unit: fewer units are the first of more */
        r->threshold[i] = nav_rng_normal(&rng);
        for (size_t j = 0; j < f; j++)
            r->projection[j * h + i] = (float)(nav_rng_normal(&rng) / sqrt((double)f));
    }
    return true;
}

static bool make(struct nav_texture_classifier *r)
{
    bool owned = own_arrays(r);
    r->expanded = calloc((size_t)(r->features + r->n.hidden), sizeof *r->expanded);
    return make_projections(r) && owned && r->expanded;
}

struct nav_texture_classifier *nav_texture_classifier_new(const struct nav_texture_classifier_numbers *numbers)
{
    if (!numbers_ok(numbers))
        return NULL;
    struct nav_texture_features *reduce = nav_texture_features_new(numbers->channels, numbers->length, numbers->levels,
                                                                   numbers->shorter, numbers->floor, numbers->shape);
    struct nav_texture_classifier *r = reduce ? calloc(1, sizeof *r) : NULL;
    if (!r) {
        nav_texture_features_free(reduce);
        return NULL;
    }
    *r = (struct nav_texture_classifier){
        .n = *numbers, .reduce = reduce, .features = nav_texture_features_count(reduce)};
    r->n.shape = NULL; /* the features have their own */
    if (!make(r)) {
        nav_texture_classifier_free(r);
        return NULL;
    }
    return r;
}

void nav_texture_classifier_free(struct nav_texture_classifier *r)
{
    if (!r)
        return;
    const double *arrays[] = {r->n.floor, r->n.centre, r->n.scale, r->n.weight, r->n.bias, r->threshold, r->expanded};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        free((void *)arrays[i]);
    free(r->projection);
    free(r->projected);
    nav_texture_features_free(r->reduce);
    free(r);
}

int nav_texture_classifier_length(const struct nav_texture_classifier *r)
{
    return r->n.length;
}

int nav_texture_classifier_count(const struct nav_texture_classifier *r)
{
    return r->features;
}

const double *nav_texture_classifier_features(const struct nav_texture_classifier *r)
{
    return r->expanded;
}

static void project(const struct nav_texture_classifier *r, const double *z, double *restrict out)
{
    int hidden = r->n.hidden;
    float *restrict sum = r->projected;
    memset(sum, 0, (size_t)hidden * sizeof *sum);
    for (int f = 0; f < r->features; f++) {
        const float *row = r->projection + (size_t)f * (size_t)hidden;
        float x = (float)z[f];
        for (int h = 0; h < hidden; h++)
            sum[h] += x * row[h];
    }
    for (int h = 0; h < hidden; h++)
        out[h] = r->threshold[h] + (double)sum[h] > 0.0 ? r->threshold[h] + (double)sum[h] : 0.0;
}

void nav_texture_classifier_expand(struct nav_texture_classifier *r, const double *window, double *out)
{
    nav_texture_features_work(r->reduce, window, out);
    for (int f = 0; f < r->features; f++)
        out[f] = (out[f] - r->n.centre[f]) * r->n.scale[f];
    project(r, out, out + r->features);
}

/* Scores of all classes from the expanded features, tempered; the best becomes 0. */
static void score(const struct nav_texture_classifier *r, const double *x, double *loglik)
{
    int classes = r->n.classes;
    memcpy(loglik, r->n.bias, (size_t)classes * sizeof *loglik);
    for (int i = 0; i < r->features + r->n.hidden; i++) {
        const double *row = r->n.weight + (size_t)i * (size_t)classes;
        for (int k = 0; k < classes; k++)
            loglik[k] += x[i] * row[k];
    }
    double best = loglik[0];
    for (int k = 1; k < classes; k++)
        best = fmax(best, loglik[k]);
    for (int k = 0; k < classes; k++)
        loglik[k] = (loglik[k] - best) * r->n.temper;
}

void nav_texture_classifier_judge(struct nav_texture_classifier *r, const double *window, double *loglik)
{
    nav_texture_classifier_expand(r, window, r->expanded);
    score(r, r->expanded, loglik);
}
