#include "texture_novelty.h"

#include "texture_classifier.h"
#include "texture_slab.h"

enum { FEATURES_MOST = 1 << 12 };

struct nav_texture_novelty {
    struct nav_texture_novelty_numbers n; /* its arrays are the detector's own */
    int windows;                          /* since the reset, at most NAV_TEXTURE_ROW */
    double *sum;                          /* [F] mean of the windows, turned */
    double *window;                       /* [F] the newest, turned */
};

static bool novelty_numbers_ok(const struct nav_texture_novelty_numbers *n)
{
    if (n->classes < 1 || n->classes > NAV_TEXTURE_CLASSES_MAX || n->features < 1 || n->features > FEATURES_MOST)
        return false;
    bool ok = true;
    for (int w = 0; w < NAV_TEXTURE_ROW; w++)
        ok = ok && isfinite(n->limit[w]) && n->limit[w] > 0.0;
    for (int f = 0; f < n->features; f++)
        ok = ok && n->row[f] >= 0.0;
    return ok;
}

static void novelty_place(void *of, struct nav_texture_slab *m)
{
    struct nav_texture_novelty *v = of;
    size_t features = (size_t)v->n.features;
    nav_texture_slab_copy(m, &v->n.turn, features * features);
    nav_texture_slab_copy(m, &v->n.mean, (size_t)v->n.classes * features);
    nav_texture_slab_copy(m, &v->n.row, features);
    nav_texture_slab_copy(m, &v->n.limit, NAV_TEXTURE_ROW);
    v->sum = nav_texture_slab_cut(m, features);
    v->window = nav_texture_slab_cut(m, features);
}

struct nav_texture_novelty *nav_texture_novelty_new(const struct nav_texture_novelty_numbers *numbers)
{
    struct nav_texture_novelty like = {.n = *numbers};
    return novelty_numbers_ok(numbers) ? nav_texture_slab_new(&like, sizeof like, novelty_place) : NULL;
}

void nav_texture_novelty_free(struct nav_texture_novelty *v)
{
    free(v);
}

int nav_texture_novelty_features(const struct nav_texture_novelty *v)
{
    return v->n.features;
}

void nav_texture_novelty_reset(struct nav_texture_novelty *v)
{
    v->windows = 0;
}

/* Once as many windows are held as the mean may rest on, the old ones fade. */
static void novelty_take(struct nav_texture_novelty *v, const double *features)
{
    int count = v->n.features;
    memset(v->window, 0, (size_t)count * sizeof *v->window);
    for (int f = 0; f < count; f++) {
        const double *row = v->n.turn + (size_t)f * (size_t)count;
        for (int a = 0; a < count; a++)
            v->window[a] += features[f] * row[a];
    }
    v->windows += v->windows < NAV_TEXTURE_ROW;
    for (int a = 0; a < count; a++)
        v->sum[a] = v->windows == 1 ? v->window[a] : v->sum[a] + (v->window[a] - v->sum[a]) / v->windows;
}

static double novelty_distance(const struct nav_texture_novelty *v, int class)
{
    const double *mean = v->n.mean + (size_t) class * (size_t)v->n.features;
    double sum = 0.0, noise = 1.0 / v->windows;
    for (int f = 0; f < v->n.features; f++) {
        double apart = v->sum[f] - mean[f];
        sum += apart * apart / (v->n.row[f] + noise);
    }
    return sum / v->n.features;
}

double nav_texture_novelty_weigh(struct nav_texture_novelty *v, const double *features)
{
    novelty_take(v, features);
    double least = INFINITY;
    for (int k = 0; k < v->n.classes; k++)
        least = fmin(least, novelty_distance(v, k));
    return least / v->n.limit[v->windows - 1];
}
