#include "texture_strange.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "texture_own.h"
#include "texture_rung.h"

struct nav_texture_strange {
    struct nav_texture_strange_numbers n; /* its arrays are its own */
    long seen;                            /* windows in a row */
    double *window;                       /* [2^steps][F] the last ones, in a circle */
    double *mean, *turned;                /* [F] */
};

enum { FEATURES_MAX = 4096 };

static bool make(struct nav_texture_strange *s)
{
    size_t f = (size_t)s->n.features, k = (size_t)s->n.classes, steps = (size_t)s->n.steps;
    bool ok = nav_texture_own(&s->n.turn, steps * f * f);
    ok = nav_texture_own(&s->n.middle, steps * k * f) && ok;
    ok = nav_texture_own(&s->n.limit, steps) && ok;
    s->window = calloc((size_t)1 << steps, f * sizeof *s->window);
    s->mean = calloc(f, sizeof *s->mean);
    s->turned = calloc(f, sizeof *s->turned);
    for (size_t i = 0; ok && i < steps; i++)
        ok = s->n.limit[i] > 0.0;
    return ok && s->window && s->mean && s->turned;
}

struct nav_texture_strange *nav_texture_strange_new(const struct nav_texture_strange_numbers *n)
{
    bool ok = n->classes >= 1 && n->classes <= NAV_TEXTURE_CLASSES_MAX && n->features >= 1 &&
              n->features <= FEATURES_MAX && n->steps >= 1 && n->steps <= NAV_TEXTURE_STRANGE_STEPS_MAX;
    struct nav_texture_strange *s = ok ? calloc(1, sizeof *s) : NULL;
    if (!s)
        return NULL;
    s->n = *n;
    if (!make(s)) {
        nav_texture_strange_free(s);
        return NULL;
    }
    return s;
}

void nav_texture_strange_free(struct nav_texture_strange *s)
{
    if (!s)
        return;
    const double *arrays[] = {s->n.turn, s->n.middle, s->n.limit, s->window, s->mean, s->turned};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        free((void *)arrays[i]);
    free(s);
}

int nav_texture_strange_features(const struct nav_texture_strange *s)
{
    return s->n.features;
}

void nav_texture_strange_reset(struct nav_texture_strange *s)
{
    s->seen = 0;
}

/* Mean of the last `count` windows. */
static void average(struct nav_texture_strange *s, long count)
{
    int features = s->n.features;
    long room = 1L << s->n.steps;
    memset(s->mean, 0, (size_t)features * sizeof *s->mean);
    for (long w = s->seen - count; w < s->seen; w++) {
        const double *row = s->window + (w % room) * features;
        for (int f = 0; f < features; f++)
            s->mean[f] += row[f] / (double)count;
    }
}

/* Row by row of features, so that the inner loop runs over neighbours. */
static void turn(struct nav_texture_strange *s, int step)
{
    int features = s->n.features;
    const double *rows = s->n.turn + (size_t)step * (size_t)features * (size_t)features;
    double *restrict out = s->turned;
    memset(out, 0, (size_t)features * sizeof *out);
    for (int f = 0; f < features; f++) {
        for (int g = 0; g < features; g++)
            out[g] += s->mean[f] * rows[f * features + g];
    }
}

static double nearest(const struct nav_texture_strange *s, int step)
{
    double best = INFINITY;
    for (int k = 0; k < s->n.classes; k++) {
        const double *middle = s->n.middle + ((size_t)step * (size_t)s->n.classes + (size_t)k) * (size_t)s->n.features;
        double sum = 0.0;
        for (int f = 0; f < s->n.features; f++)
            sum += (s->turned[f] - middle[f]) * (s->turned[f] - middle[f]);
        best = fmin(best, sum);
    }
    return best / s->n.features;
}

double nav_texture_strange_weigh(struct nav_texture_strange *s, const double *features)
{
    size_t row = (size_t)s->n.features;
    memcpy(s->window + (size_t)(s->seen % (1L << s->n.steps)) * row, features, row * sizeof *features);
    s->seen++;
    int step = -1;
    while (step + 1 < s->n.steps && 2L << (step + 1) <= s->seen)
        step++;
    if (step < 0)
        return 0.0;
    average(s, 2L << step);
    turn(s, step);
    return nearest(s, step) / s->n.limit[step];
}
