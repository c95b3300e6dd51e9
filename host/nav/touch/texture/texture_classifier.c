#include "texture_classifier.h"

#include "texture_features.h"
#include "texture_slab.h"

struct nav_texture_classifier {
    struct nav_texture_classifier_numbers n; /* its arrays are the classifier's own */
    int count;
    struct nav_texture_features *reduce;
    double *features; /* [F] of the last window */
};

static void classifier_place(void *of, struct nav_texture_slab *m)
{
    struct nav_texture_classifier *r = of;
    size_t f = (size_t)r->count, k = (size_t)r->n.classes;
    nav_texture_slab_copy(m, &r->n.weight, f * k);
    nav_texture_slab_copy(m, &r->n.bias, k);
    r->features = nav_texture_slab_cut(m, f);
}

struct nav_texture_classifier *nav_texture_classifier_new(const struct nav_texture_classifier_numbers *n)
{
    if (n->classes < 1 || n->classes > NAV_TEXTURE_CLASSES_MAX || !isfinite(n->behind) || n->behind < 0.0)
        return NULL;
    struct nav_texture_features *reduce = nav_texture_features_new(n->channels, n->length, n->floor, n->shape);
    if (!reduce)
        return NULL;
    struct nav_texture_classifier like = {.n = *n, .reduce = reduce, .count = nav_texture_features_count(reduce)};
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

double nav_texture_classifier_behind(const struct nav_texture_classifier *r)
{
    return r->n.behind;
}

int nav_texture_classifier_count(const struct nav_texture_classifier *r)
{
    return r->count;
}

const double *nav_texture_classifier_features(const struct nav_texture_classifier *r)
{
    return r->features;
}

void nav_texture_classifier_judge(struct nav_texture_classifier *r, const double *window, double *loglik)
{
    int classes = r->n.classes;
    nav_texture_features_work(r->reduce, window, r->features);
    memcpy(loglik, r->n.bias, (size_t)classes * sizeof *loglik);
    for (int f = 0; f < r->count; f++) {
        const double *row = r->n.weight + (size_t)f * (size_t)classes;
        for (int k = 0; k < classes; k++)
            loglik[k] += r->features[f] * row[k];
    }
    double best = loglik[0];
    for (int k = 1; k < classes; k++)
        best = fmax(best, loglik[k]);
    for (int k = 0; k < classes; k++)
        loglik[k] -= best;
}
