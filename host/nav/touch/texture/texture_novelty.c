#include "texture_novelty.h"

#include "texture_classifier.h"
#include "texture_slab.h"

enum { FEATURES_MOST = 1 << 12, STEPS = NAV_TEXTURE_NOVELTY_STEPS, WINDOWS_MOST = 1 << (STEPS - 1) };

struct nav_texture_novelty {
    struct nav_texture_novelty_numbers n; /* its arrays are the detector's own */
    int windows;                          /* since the reset, at most WINDOWS_MOST */
    double *sum;                          /* [F] mean of the windows, turned */
    double *window;                       /* [F] the newest, turned */
    double *normaliser;                   /* [WINDOWS_MOST + 1][K + 1] half the log determinants */
};

static bool novelty_numbers_ok(const struct nav_texture_novelty_numbers *n)
{
    if (n->classes < 1 || n->classes > NAV_TEXTURE_CLASSES_MAX || n->features < 1 || n->features > FEATURES_MOST)
        return false;
    bool ok = isfinite(n->scale) && n->scale > 0.0;
    for (int f = 0; f < n->features; f++)
        ok = ok && n->noise[f] > 0.0;
    for (int i = 0; i < (n->classes + 1) * n->features; i++)
        ok = ok && n->recording[i] >= 0.0;
    return ok;
}

/* The log determinants depend on the number of windows only. */
static void novelty_normalise(struct nav_texture_novelty *v)
{
    for (int w = 1; w <= WINDOWS_MOST; w++) {
        for (int k = 0; k <= v->n.classes; k++) {
            const double *recording = v->n.recording + (size_t)k * (size_t)v->n.features;
            double sum = 0.0;
            for (int f = 0; f < v->n.features; f++)
                sum += log(recording[f] + v->n.noise[f] / w);
            v->normaliser[w * (v->n.classes + 1) + k] = 0.5 * sum;
        }
    }
}

static void novelty_place(void *of, struct nav_texture_slab *m)
{
    struct nav_texture_novelty *v = of;
    size_t features = (size_t)v->n.features, rows = (size_t)v->n.classes + 1;
    nav_texture_slab_copy(m, &v->n.turn, features * features);
    nav_texture_slab_copy(m, &v->n.mean, rows * features);
    nav_texture_slab_copy(m, &v->n.recording, rows * features);
    nav_texture_slab_copy(m, &v->n.noise, features);
    nav_texture_slab_copy(m, &v->n.limit, STEPS);
    v->sum = nav_texture_slab_cut(m, features);
    v->window = nav_texture_slab_cut(m, features);
    v->normaliser = nav_texture_slab_cut(m, (WINDOWS_MOST + 1) * rows);
    if (m->at)
        novelty_normalise(v);
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
    v->windows += v->windows < WINDOWS_MOST;
    for (int a = 0; a < count; a++)
        v->sum[a] = v->windows == 1 ? v->window[a] : v->sum[a] + (v->window[a] - v->sum[a]) / v->windows;
}

static double novelty_log_likelihood(const struct nav_texture_novelty *v, int row)
{
    const double *mean = v->n.mean + (size_t)row * (size_t)v->n.features;
    const double *recording = v->n.recording + (size_t)row * (size_t)v->n.features;
    double sum = 0.0, share = 1.0 / v->windows;
    for (int f = 0; f < v->n.features; f++) {
        double apart = v->sum[f] - mean[f];
        sum += apart * apart / (recording[f] + share * v->n.noise[f]);
    }
    return -0.5 * sum - v->normaliser[v->windows * (v->n.classes + 1) + row];
}

static int novelty_step(int windows)
{
    int step = 0;
    while (step + 1 < STEPS && (2 << step) <= windows)
        step++;
    return step;
}

double nav_texture_novelty_weigh(struct nav_texture_novelty *v, const double *features)
{
    novelty_take(v, features);
    double trained = -INFINITY;
    for (int k = 0; k < v->n.classes; k++)
        trained = fmax(trained, novelty_log_likelihood(v, k));
    double ratio = novelty_log_likelihood(v, v->n.classes) - trained;
    return (ratio - v->n.limit[novelty_step(v->windows)]) / v->n.scale;
}
