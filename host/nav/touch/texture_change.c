#include "texture_change.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "texture_classifier.h"
#include "texture_features.h"
#include "texture_own.h"

enum {
    LEAST = NAV_TEXTURE_CHANGE_AFTER_LEAST,
    MOST = NAV_TEXTURE_CHANGE_AFTER_MOST,
    HELD_MOST = NAV_TEXTURE_CHANGE_AFTER_MOST + NAV_TEXTURE_CHANGE_BEFORE_MOST
};
#define NO_RATIO (-1e9)
#define STRAY 0.01      /* share of blocks that say nothing of their class: bounds what one block can claim */
#define NAMED 0.5       /* weight of what both sides say of their class by themselves, beside the difference */
#define NAMED_MOST 20.0 /* nats: no side is more sure than that which class it is not */

struct nav_texture_change {
    struct nav_texture_change_numbers n; /* its arrays are the detector's own */
    int features, held;                  /* blocks held, the newest last */
    struct nav_texture_features *reduce;
    double *feature; /* [F] */
    double *block;   /* [HELD_MOST][2][K] scores within a drive, log posteriors */
    double *sum;     /* [4][2][K] sums before and behind the change, then both finished */
};

static bool make(struct nav_texture_change *c)
{
    size_t f = (size_t)c->features, k = (size_t)c->n.classes;
    bool ok = nav_texture_own(&c->n.floor, (size_t)c->n.channels);
    ok = nav_texture_own(&c->n.steady, f * k) && ok;
    ok = nav_texture_own(&c->n.apart, k * k) && ok;
    ok = nav_texture_own(&c->n.weight, f * k) && ok;
    ok = nav_texture_own(&c->n.bias, k) && ok;
    c->feature = calloc(f, sizeof *c->feature);
    c->block = calloc(2 * HELD_MOST * k, sizeof *c->block);
    c->sum = calloc(8 * k, sizeof *c->sum);
    return ok && c->feature && c->block && c->sum;
}

static bool numbers_ok(const struct nav_texture_change_numbers *n)
{
    return n->classes >= 1 && n->classes <= NAV_TEXTURE_CLASSES_MAX && isfinite(n->limit) && n->share >= 0.0 &&
           n->share <= 1.0;
}

struct nav_texture_change *nav_texture_change_new(const struct nav_texture_change_numbers *numbers)
{
    if (!numbers_ok(numbers))
        return NULL;
    struct nav_texture_features *reduce =
        nav_texture_features_new(numbers->channels, numbers->length, 0, 0, numbers->floor);
    struct nav_texture_change *c = reduce ? calloc(1, sizeof *c) : NULL;
    if (!c) {
        nav_texture_features_free(reduce);
        return NULL;
    }
    *c = (struct nav_texture_change){.n = *numbers, .reduce = reduce, .features = nav_texture_features_count(reduce)};
    if (!make(c)) {
        nav_texture_change_free(c);
        return NULL;
    }
    return c;
}

void nav_texture_change_free(struct nav_texture_change *c)
{
    if (!c)
        return;
    const double *arrays[] = {c->n.floor, c->n.steady, c->n.apart, c->n.weight,
                              c->n.bias,  c->feature,  c->block,   c->sum};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        free((void *)arrays[i]);
    nav_texture_features_free(c->reduce);
    free(c);
}

int nav_texture_change_length(const struct nav_texture_change *c)
{
    return c->n.length;
}

double nav_texture_change_limit(const struct nav_texture_change *c)
{
    return c->n.limit;
}

void nav_texture_change_keep(struct nav_texture_change *c, int keep)
{
    size_t row = 2 * (size_t)c->n.classes;
    if (keep >= c->held)
        return;
    memmove(c->block, c->block + (size_t)(c->held - keep) * row, (size_t)keep * row * sizeof *c->block);
    c->held = keep;
}

/* Log-likelihoods to log posteriors under equal priors, when a block says nothing of its class now and then. */
static void normalise(double *log_of, int classes)
{
    double best = log_of[0], sum = 0.0;
    for (int k = 1; k < classes; k++)
        best = fmax(best, log_of[k]);
    for (int k = 0; k < classes; k++)
        sum += log_of[k] = exp(log_of[k] - best);
    for (int k = 0; k < classes; k++)
        log_of[k] = log((1.0 - STRAY) * log_of[k] / sum + STRAY / classes);
}

static void take(struct nav_texture_change *c, const double *block)
{
    int classes = c->n.classes;
    nav_texture_change_keep(c, HELD_MOST - 1);
    double *scores = c->block + 2 * (size_t)classes * (size_t)c->held++, *named = scores + classes;
    nav_texture_features_work(c->reduce, block, c->feature);
    memset(scores, 0, (size_t)classes * sizeof *scores);
    memcpy(named, c->n.bias, (size_t)classes * sizeof *named);
    for (int f = 0; f < c->features; f++) {
        const double *steady = c->n.steady + (size_t)f * (size_t)classes;
        const double *weight = c->n.weight + (size_t)f * (size_t)classes;
        for (int k = 0; k < classes; k++) {
            scores[k] += c->feature[f] * steady[k];
            named[k] += c->feature[f] * weight[k];
        }
    }
    for (int k = 0; k < classes; k++)
        named[k] *= c->n.share;
    normalise(named, classes);
}

/* out[K]: scores' mean over so many blocks; out[K + k]: log-likelihood of class k in all of them, the best's 0. */
static void finish(const double *sum, int classes, int blocks, double *restrict out)
{
    double best = sum[classes];
    for (int k = 1; k < classes; k++)
        best = sum[classes + k] > best ? sum[classes + k] : best;
    for (int k = 0; k < classes; k++) {
        double named = sum[classes + k] - best;
        out[k] = sum[k] / blocks;
        out[classes + k] = named > -NAMED_MOST ? named : -NAMED_MOST;
    }
}

/* Ratio of the likeliest pair of classes for a change with `after` of the blocks behind it, given both sides' finished
 * sums. A difference beyond the classes' own is no more evidence than that. */
static double ratio(const struct nav_texture_change *c, const double *early, const double *late, int after)
{
    int classes = c->n.classes, before = c->held - after;
    double blocks = c->n.share * after * before / (after + before), best = NO_RATIO;
    for (int k = 0; k < classes; k++) {
        for (int j = 0; j < classes; j++) {
            double apart = c->n.apart[k * classes + j], moved = late[j] - late[k] - early[j] + early[k];
            double named = NAMED * (early[classes + k] + late[classes + j]);
            double here = blocks * ((moved < apart ? moved : apart) - 0.5 * apart) + named;
            if (j != k && here > best)
                best = here;
        }
    }
    return best;
}

/* Moves a block from one side of the change to the other. */
static void move(const struct nav_texture_change *c, int block, double *restrict early, double *restrict late)
{
    int width = 2 * c->n.classes;
    const double *row = c->block + (size_t)width * (size_t)block;
    for (int k = 0; k < width; k++) {
        early[k] -= row[k];
        late[k] += row[k];
    }
}

double nav_texture_change_weigh(struct nav_texture_change *c, const double *block, int *after)
{
    int classes = c->n.classes;
    double *early = c->sum, *late = early + 2 * (size_t)classes, *side = late + 2 * (size_t)classes, best = NO_RATIO;
    *after = 0;
    take(c, block);
    memset(c->sum, 0, 8 * (size_t)classes * sizeof *c->sum);
    for (int b = 0; b < c->held; b++) /* all blocks into `early`: what leaves the other side comes to this one */
        move(c, b, side, early);
    for (int a = 1; a <= MOST && 2 * a <= c->held; a++) {
        move(c, c->held - a, early, late);
        if (a < LEAST)
            continue;
        finish(early, classes, c->held - a, side);
        finish(late, classes, a, side + 2 * (size_t)classes);
        double here = ratio(c, side, side + 2 * (size_t)classes, a);
        if (here > best) {
            best = here;
            *after = a;
        }
    }
    return best;
}
