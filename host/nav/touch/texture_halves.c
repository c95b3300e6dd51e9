#include "texture_halves.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool nav_texture_halves_make(struct nav_texture_halves *h, const struct nav_texture_rules *rules, const double *border)
{
    *h = (struct nav_texture_halves){.channels = rules->channels,
                                     .classes = rules->classes,
                                     .growth = rules->growth,
                                     .together = rules->together,
                                     .border = border};
    h->before = calloc((size_t)h->classes, sizeof *h->before);
    bool ok = h->before;
    for (int i = 0; i < 3; i++) {
        h->half[i] = calloc((size_t)h->classes, sizeof *h->half[i]);
        ok = ok && h->half[i];
    }
    return ok;
}

void nav_texture_halves_free(struct nav_texture_halves *h)
{
    free(h->before);
    for (int i = 0; i < 3; i++)
        free(h->half[i]);
}

/* Two views of the same samples, the whole and its halves, err differently: their mean errs less than either. */
static void blend(const struct nav_texture_halves *h, double *loglik)
{
    double best = -INFINITY, both = 0.5 * pow(2.0, h->growth);
    for (int k = 0; k < h->classes; k++) {
        loglik[k] = 0.5 * (loglik[k] + both * (h->half[1][k] + h->half[2][k])) * h->together;
        best = fmax(best, loglik[k]);
    }
    for (int k = 0; k < h->classes; k++)
        loglik[k] -= best;
}

int nav_texture_halves_judge(struct nav_texture_halves *h, struct nav_texture_span *span, const double *from, int n,
                             double *loglik)
{
    int first = n / 2, later = n - first;
    const double *middle = from + (size_t)first * (size_t)h->channels;
    int one = nav_texture_span_judge(span, from, first, h->half[1]);
    int two = nav_texture_span_judge(span, middle, later, h->half[2]);
    if (one != two || one < 0)
        return -1;
    blend(h, loglik);
    return one;
}

/* Whether two stretches, judged at this classifier, are of two surfaces: no class explains both. */
static bool differ(const struct nav_texture_halves *h, int classifier, const double *a, const double *b)
{
    double shared = -INFINITY;
    for (int k = 0; k < h->classes; k++)
        shared = fmax(shared, a[k] + b[k]);
    return classifier >= 0 && -shared > h->border[classifier];
}

static void swap(double **a, double **b)
{
    double *kept = *a;
    *a = *b;
    *b = kept;
}

bool nav_texture_halves_border(struct nav_texture_halves *h, double *loglik, int classifier, int half_classifier)
{
    bool inside = differ(h, half_classifier, h->half[1], h->half[2]);
    bool since = h->has_before &&
                 ((h->half_classifier == half_classifier && differ(h, half_classifier, h->half[0], h->half[1])) ||
                  (h->before_classifier == classifier && differ(h, classifier, h->before, loglik)) ||
                  differ(h, half_classifier, h->before, h->half[2]));
    size_t bytes = (size_t)h->classes * sizeof *loglik;
    if (inside)
        memcpy(loglik, h->half[2], bytes);
    memcpy(h->before, loglik, bytes);
    h->before_classifier = inside ? -1 : classifier;
    h->half_classifier = half_classifier;
    swap(&h->half[0], &h->half[2]);
    h->has_before = true;
    return inside || since;
}
