#include "texture_classifier.h"

#include "rng.h"
#include "texture_features.h"
#include "texture_slab.h"

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

/* Directions of unit mean square on standardised features; thresholds spread as the projections are. */
static void classifier_project_at_random(struct nav_texture_classifier *r)
{
    size_t f = (size_t)r->features, h = (size_t)r->n.hidden;
    struct nav_rng rng;
    nav_rng_seed(&rng, r->n.seed, 0);
    for (size_t i = 0; i < h; i++) { /* unit by unit: fewer units are the first of more */
        r->threshold[i] = nav_rng_normal(&rng);
        for (size_t j = 0; j < f; j++)
            r->projection[j * h + i] = (float)(nav_rng_normal(&rng) / sqrt((double)f));
    }
}

static void classifier_place(void *of, struct nav_texture_slab *m)
{
    struct nav_texture_classifier *r = of;
    size_t f = (size_t)r->features, k = (size_t)r->n.classes, h = (size_t)r->n.hidden;
    nav_texture_slab_copy(m, &r->n.centre, f);
    nav_texture_slab_copy(m, &r->n.scale, f);
    nav_texture_slab_copy(m, &r->n.weight, (f + h) * k);
    nav_texture_slab_copy(m, &r->n.bias, k);
    r->expanded = nav_texture_slab_cut(m, f + h);
    r->threshold = nav_texture_slab_cut(m, h);
    r->projected = (float *)nav_texture_slab_cut(m, h);
    r->projection = (float *)nav_texture_slab_cut(m, f * h);
    if (m->at)
        classifier_project_at_random(r);
}

static bool classifier_sizes_ok(const struct nav_texture_classifier_numbers *n)
{
    return n->classes >= 1 && n->classes <= NAV_TEXTURE_CLASSES_MAX && n->hidden >= 0 &&
           n->hidden <= NAV_TEXTURE_HIDDEN_MAX && isfinite(n->temper) && n->temper >= 0.0;
}

struct nav_texture_classifier *nav_texture_classifier_new(const struct nav_texture_classifier_numbers *n)
{
    if (!classifier_sizes_ok(n))
        return NULL;
    struct nav_texture_features *reduce =
        nav_texture_features_new(n->channels, n->length, n->levels, n->shorter, n->floor, n->shape);
    if (!reduce)
        return NULL;
    struct nav_texture_classifier like = {.n = *n, .reduce = reduce, .features = nav_texture_features_count(reduce)};
    like.n.floor = like.n.shape = NULL; /* the features have their own */
    struct nav_texture_classifier *r = nav_texture_slab_new(&like, sizeof like, classifier_place);
    if (!r)
        nav_texture_features_free(reduce);
    return r;
}

void nav_texture_classifier_free(struct nav_texture_classifier *r)
{
    if (r)
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

static void classifier_project(const struct nav_texture_classifier *r, const double *z, double *restrict out)
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
    classifier_project(r, out, out + r->features);
}

/* Scores of all classes from the expanded features, tempered; the best becomes 0. */
static void classifier_score(const struct nav_texture_classifier *r, const double *x, double *loglik)
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
    classifier_score(r, r->expanded, loglik);
}
