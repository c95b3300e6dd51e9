#include "texture_slide.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define PER_NAT 4294967296.0 /* 2^32: a window of 2^20 samples of 64 channels at 20 nats stays within 63 bits */
#define LOG_LEAST (-20.0)    /* nats of one sample: rarer than once in 10^8 is never told from a finite training set */

struct nav_texture_slide {
    const struct nav_texture *model; /* its bins only */
    int whiskers, window, classes, axes, bins;
    int64_t *table; /* [axis][bin][class]: what one sample adds to all classes lies together */
    int64_t *sum;   /* [whisker][class] */
    int *held;      /* [window][whisker][axis] bins; the first axis is -1 for no evidence */
    long *used, *bad;
    int next, full;
};

static void copy_table(struct nav_texture_slide *s, const double *table)
{
    for (int k = 0; k < s->classes; k++) {
        for (int i = 0; i < s->axes * s->bins; i++) {
            double nats = fmin(fmax(table[k * s->axes * s->bins + i], LOG_LEAST), 0.0);
            s->table[i * s->classes + k] = llround(nats * PER_NAT);
        }
    }
}

static int allocate(struct nav_texture_slide *s)
{
    size_t whiskers = (size_t)s->whiskers, classes = (size_t)s->classes, axes = (size_t)s->axes;
    s->table = calloc(axes * (size_t)s->bins * classes, sizeof *s->table);
    s->sum = calloc(whiskers * classes, sizeof *s->sum);
    s->held = calloc((size_t)s->window * whiskers * axes, sizeof *s->held);
    s->used = calloc(whiskers, sizeof *s->used);
    s->bad = calloc(whiskers, sizeof *s->bad);
    return s->table && s->sum && s->held && s->used && s->bad;
}

struct nav_texture_slide *nav_texture_slide_new(const struct nav_texture *model, int whiskers, int window)
{
    if (whiskers < 1 || window < 1 || window > NAV_TEXTURE_SLIDE_MAX)
        return NULL;
    struct nav_texture_slide *s = calloc(1, sizeof *s);
    if (!s)
        return NULL;
    *s = (struct nav_texture_slide){.model = model, .whiskers = whiskers, .window = window};
    s->classes = nav_texture_classes(model);
    s->axes = nav_texture_axes(model);
    s->bins = nav_texture_bins(model);
    if (!allocate(s)) {
        nav_texture_slide_free(s);
        return NULL;
    }
    copy_table(s, nav_texture_table((struct nav_texture *)model));
    return s;
}

void nav_texture_slide_free(struct nav_texture_slide *s)
{
    if (!s)
        return;
    free(s->table);
    free(s->sum);
    free(s->held);
    free(s->used);
    free(s->bad);
    free(s);
}

void nav_texture_slide_reset(struct nav_texture_slide *s)
{
    memset(s->sum, 0, (size_t)s->whiskers * (size_t)s->classes * sizeof *s->sum);
    memset(s->used, 0, (size_t)s->whiskers * sizeof *s->used);
    s->next = s->full = 0;
}

/* Adds (sign 1) or takes off (-1) a sample whose bins are known. */
static void count(struct nav_texture_slide *s, int whisker, const int *bin, int sign)
{
    if (bin[0] < 0)
        return;
    int64_t *sum = s->sum + (size_t)whisker * (size_t)s->classes;
    for (int a = 0; a < s->axes; a++) {
        const int64_t *entry = s->table + (size_t)(a * s->bins + bin[a]) * (size_t)s->classes;
        for (int k = 0; k < s->classes; k++)
            sum[k] += sign * entry[k];
    }
    s->used[whisker] += sign;
}

static void take(struct nav_texture_slide *s, int whisker, const double *sample)
{
    int *bin = s->held + ((size_t)s->next * (size_t)s->whiskers + (size_t)whisker) * (size_t)s->axes;
    if (s->full)
        count(s, whisker, bin, -1);
    if (!nav_texture_place(s->model, sample, bin)) {
        bin[0] = -1;
        s->bad[whisker]++;
    }
    count(s, whisker, bin, 1);
}

void nav_texture_slide_push(struct nav_texture_slide *s, const double *samples, long n)
{
    for (long i = 0; i < n; i++) {
        for (int w = 0; w < s->whiskers; w++)
            take(s, w, samples + ((size_t)i * (size_t)s->whiskers + (size_t)w) * (size_t)s->axes);
        s->next = (s->next + 1) % s->window;
        s->full |= s->next == 0;
    }
}

long nav_texture_slide_loglik(const struct nav_texture_slide *s, int whisker, double *loglik)
{
    for (int k = 0; k < s->classes; k++)
        loglik[k] = (double)s->sum[(size_t)whisker * (size_t)s->classes + (size_t)k] / PER_NAT;
    return s->used[whisker];
}

long nav_texture_slide_bad(const struct nav_texture_slide *s, int whisker)
{
    return s->bad[whisker];
}
