#include "texture_span.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct nav_texture_span {
    int channels, classes, classifiers;
    struct nav_texture_classifier *classifier[NAV_TEXTURE_CLASSIFIERS_MAX];
    double growth;
    double *part; /* [classes] of one classifier's window */
};

struct nav_texture_span *nav_texture_span_new(const struct nav_texture_rules *rules)
{
    struct nav_texture_span *s = calloc(1, sizeof *s);
    if (!s)
        return NULL;
    s->channels = rules->channels;
    s->classes = rules->classes;
    s->classifiers = rules->classifiers;
    s->growth = rules->growth;
    memcpy(s->classifier, rules->classifier, (size_t)rules->classifiers * sizeof *s->classifier);
    s->part = calloc((size_t)s->classes, sizeof *s->part);
    if (!s->part) {
        free(s);
        return NULL;
    }
    return s;
}

void nav_texture_span_free(struct nav_texture_span *s)
{
    if (!s)
        return;
    free(s->part);
    free(s);
}

static int longest_within(const struct nav_texture_span *s, int n)
{
    int classifier = s->classifiers - 1;
    while (classifier >= 0 && nav_texture_classifier_length(s->classifier[classifier]) > n)
        classifier--;
    return classifier;
}

/* Evidence grows with length; the largest log-likelihood becomes 0. */
static void finish(const struct nav_texture_span *s, double *loglik, int windows, double lengths)
{
    double best = -INFINITY, factor = pow(lengths, s->growth) / windows;
    for (int k = 0; k < s->classes; k++)
        best = fmax(best, loglik[k]);
    for (int k = 0; k < s->classes; k++)
        loglik[k] = (loglik[k] - best) * factor;
}

int nav_texture_span_judge(struct nav_texture_span *s, const double *window, int n, double *loglik)
{
    int classifier = longest_within(s, n);
    memset(loglik, 0, (size_t)s->classes * sizeof *loglik);
    if (classifier < 0)
        return -1;
    int length = nav_texture_classifier_length(s->classifier[classifier]);
    int windows = (n + length - 1) / length;
    for (int w = 0; w < windows; w++) {
        long start = windows > 1 ? (long)(n - length) * w / (windows - 1) : 0;
        nav_texture_classifier_judge(s->classifier[classifier], window + (size_t)start * (size_t)s->channels, s->part);
        for (int k = 0; k < s->classes; k++)
            loglik[k] += s->part[k];
    }
    finish(s, loglik, windows, (double)n / length);
    return classifier;
}
