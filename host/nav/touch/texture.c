#include "texture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct nav_texture {
    int classes, axes, bins;
    double *low;       /* [axes] lower edge of the first bin, counts */
    double *per_count; /* [axes] bins per count */
    double *table;     /* [class][axis][bin] counts until finished, then log-likelihoods */
};

static size_t table_size(const struct nav_texture *t)
{
    return (size_t)t->classes * (size_t)t->axes * (size_t)t->bins;
}

static bool ranges_ok(int axes, const double *low, const double *high)
{
    for (int a = 0; a < axes; a++) {
        if (!isfinite(low[a]) || !isfinite(high[a]) || !(high[a] > low[a]))
            return false;
    }
    return true;
}

struct nav_texture *nav_texture_new(int classes, int axes, int bins, const double *low, const double *high)
{
    if (classes < 1 || axes < 1 || bins < 1 || !ranges_ok(axes, low, high))
        return NULL;
    struct nav_texture *t = calloc(1, sizeof *t);
    if (!t)
        return NULL;
    *t = (struct nav_texture){.classes = classes, .axes = axes, .bins = bins};
    t->low = calloc((size_t)axes, sizeof *t->low);
    t->per_count = calloc((size_t)axes, sizeof *t->per_count);
    t->table = calloc(table_size(t), sizeof *t->table);
    if (!t->low || !t->per_count || !t->table) {
        nav_texture_free(t);
        return NULL;
    }
    for (int a = 0; a < axes; a++) {
        t->low[a] = low[a];
        t->per_count[a] = bins / (high[a] - low[a]);
    }
    return t;
}

void nav_texture_free(struct nav_texture *t)
{
    if (!t)
        return;
    free(t->low);
    free(t->per_count);
    free(t->table);
    free(t);
}

static bool finite_sample(const double *sample, int axes)
{
    for (int a = 0; a < axes; a++) {
        if (!isfinite(sample[a]))
            return false;
    }
    return true;
}

static size_t bin_of(const struct nav_texture *t, int axis, double value)
{
    double place = floor((value - t->low[axis]) * t->per_count[axis]);
    if (!(place > 0.0))
        return 0;
    return place < t->bins ? (size_t)place : (size_t)t->bins - 1;
}

static double *row(const struct nav_texture *t, int class_index, int axis)
{
    return t->table + (size_t)(class_index * t->axes + axis) * (size_t)t->bins;
}

long nav_texture_add(struct nav_texture *t, int class_index, const double *samples, size_t n)
{
    if (class_index < 0 || class_index >= t->classes)
        return -1;
    long used = 0;
    for (size_t i = 0; i < n; i++) {
        const double *sample = samples + i * (size_t)t->axes;
        if (!finite_sample(sample, t->axes))
            continue;
        for (int a = 0; a < t->axes; a++)
            row(t, class_index, a)[bin_of(t, a, sample[a])] += 1.0;
        used++;
    }
    return used;
}

static void finish_row(double *bins, int n, double pseudo)
{
    double total = 0.0;
    for (int b = 0; b < n; b++)
        total += bins[b] + pseudo;
    for (int b = 0; b < n; b++)
        bins[b] = log((bins[b] + pseudo) / total);
}

void nav_texture_finish(struct nav_texture *t, double pseudo)
{
    for (int k = 0; k < t->classes; k++) {
        for (int a = 0; a < t->axes; a++)
            finish_row(row(t, k, a), t->bins, pseudo);
    }
}

size_t nav_texture_loglik(const struct nav_texture *t, const double *samples, size_t n, double *loglik)
{
    size_t used = 0;
    memset(loglik, 0, (size_t)t->classes * sizeof *loglik);
    for (size_t i = 0; i < n; i++) {
        const double *sample = samples + i * (size_t)t->axes;
        if (!finite_sample(sample, t->axes))
            continue;
        for (int a = 0; a < t->axes; a++) {
            size_t bin = bin_of(t, a, sample[a]);
            for (int k = 0; k < t->classes; k++)
                loglik[k] += row(t, k, a)[bin];
        }
        used++;
    }
    return used;
}

double *nav_texture_table(struct nav_texture *t)
{
    return t->table;
}

int nav_texture_classes(const struct nav_texture *t)
{
    return t->classes;
}

int nav_texture_axes(const struct nav_texture *t)
{
    return t->axes;
}

int nav_texture_bins(const struct nav_texture *t)
{
    return t->bins;
}

bool nav_texture_place(const struct nav_texture *t, const double *sample, int *bin)
{
    if (!finite_sample(sample, t->axes))
        return false;
    for (int a = 0; a < t->axes; a++)
        bin[a] = (int)bin_of(t, a, sample[a]);
    return true;
}
