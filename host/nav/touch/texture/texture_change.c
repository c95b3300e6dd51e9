#include "texture_change.h"

#include "texture_classifier.h"
#include "texture_features.h"
#include "texture_slab.h"

enum {
    LEAST = NAV_TEXTURE_CHANGE_AFTER_LEAST,
    MOST = NAV_TEXTURE_CHANGE_AFTER_MOST,
    HELD_MOST = NAV_TEXTURE_CHANGE_AFTER_MOST + NAV_TEXTURE_CHANGE_BEFORE_MOST
};
#define NO_RATIO (-1e9)
#define NO_EDGE (1 << 20)
#define AT_EDGE 2.2     /* nats: nine to one for a change at an edge, where the surface is as likely to change as not */
#define STRAY 0.01      /* share of blocks that say nothing of their class: bounds what one block can claim */
#define NAMED 0.5       /* weight of what both sides say of their class by themselves, beside the difference */
#define NAMED_MOST 20.0 /* nats: no side is more sure than that which class it is not */

struct nav_texture_change {
    struct nav_texture_change_numbers n; /* its arrays are the detector's own */
    int features, held;                  /* blocks held, the newest last */
    int behind;                          /* blocks since an edge, -1 until one is left out, or NO_EDGE */
    struct nav_texture_features *reduce;
    double *feature; /* [F] */
    double *block;   /* [HELD_MOST][2][2][K] by rule: scores within a drive, log posteriors */
    double *sum;     /* [4][2][2][K] sums before and behind the change, then both finished */
};

static void change_place_rule(struct nav_texture_change_rule *r, struct nav_texture_slab *m, size_t f, size_t k)
{
    nav_texture_slab_copy(m, &r->steady, f * k);
    nav_texture_slab_copy(m, &r->apart, k * k);
    nav_texture_slab_copy(m, &r->weight, f * k);
    nav_texture_slab_copy(m, &r->bias, k);
}

static void change_place(void *of, struct nav_texture_slab *m)
{
    struct nav_texture_change *c = of;
    size_t f = (size_t)c->features, k = (size_t)c->n.classes;
    change_place_rule(&c->n.inside, m, f, k);
    change_place_rule(&c->n.edge, m, f, k);
    c->feature = nav_texture_slab_cut(m, f);
    c->block = nav_texture_slab_cut(m, 4 * HELD_MOST * k);
    c->sum = nav_texture_slab_cut(m, 16 * k);
}

struct nav_texture_change *nav_texture_change_new(const struct nav_texture_change_numbers *n)
{
    bool ok = n->classes >= 1 && n->classes <= NAV_TEXTURE_CLASSES_MAX && isfinite(n->limit) && n->share >= 0.0 &&
              n->share <= 1.0;
    struct nav_texture_features *reduce =
        ok ? nav_texture_features_new(n->channels, n->length, 0, 0, n->floor, NULL) : NULL;
    if (!reduce)
        return NULL;
    struct nav_texture_change like = {
        .n = *n, .reduce = reduce, .features = nav_texture_features_count(reduce), .behind = NO_EDGE};
    like.n.floor = NULL; /* the features have their own */
    struct nav_texture_change *c = nav_texture_slab_new(&like, sizeof like, change_place);
    if (!c)
        nav_texture_features_free(reduce);
    return c;
}

void nav_texture_change_free(struct nav_texture_change *c)
{
    if (c)
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

/* Forgets all blocks but the last `keep`. */
static void change_keep_last(struct nav_texture_change *c, int keep)
{
    size_t row = 4 * (size_t)c->n.classes;
    if (keep >= c->held)
        return;
    memmove(c->block, c->block + (size_t)(c->held - keep) * row, (size_t)keep * row * sizeof *c->block);
    c->held = keep;
}

void nav_texture_change_reset(struct nav_texture_change *c)
{
    c->held = 0;
    c->behind = NO_EDGE;
}

void nav_texture_change_edge(struct nav_texture_change *c)
{
    c->behind = -1;
}

/* Log-likelihoods to log posteriors under equal priors, when a block says nothing of its class now and then. */
static void change_normalise(double *log_of, int classes)
{
    double best = log_of[0], sum = 0.0;
    for (int k = 1; k < classes; k++)
        best = fmax(best, log_of[k]);
    for (int k = 0; k < classes; k++)
        sum += log_of[k] = exp(log_of[k] - best);
    for (int k = 0; k < classes; k++)
        log_of[k] = log((1.0 - STRAY) * log_of[k] / sum + STRAY / classes);
}

/* out[2][K]: a block's scores by a rule, and its log posteriors. */
static void change_score(const struct nav_texture_change *c, const struct nav_texture_change_rule *r,
                         double *restrict out)
{
    int classes = c->n.classes;
    double *named = out + classes;
    memset(out, 0, (size_t)classes * sizeof *out);
    memcpy(named, r->bias, (size_t)classes * sizeof *named);
    for (int f = 0; f < c->features; f++) {
        const double *steady = r->steady + (size_t)f * (size_t)classes;
        const double *weight = r->weight + (size_t)f * (size_t)classes;
        for (int k = 0; k < classes; k++) {
            out[k] += c->feature[f] * steady[k];
            named[k] += c->feature[f] * weight[k];
        }
    }
    for (int k = 0; k < classes; k++)
        named[k] *= c->n.share;
    change_normalise(named, classes);
}

static void change_take(struct nav_texture_change *c, const double *block)
{
    change_keep_last(c, HELD_MOST - 1);
    double *scores = c->block + 4 * (size_t)c->n.classes * (size_t)c->held++;
    nav_texture_features_work(c->reduce, block, c->feature);
    change_score(c, &c->n.inside, scores);
    change_score(c, &c->n.edge, scores + 2 * (size_t)c->n.classes);
}

/* out[K]: scores' mean over so many blocks; out[K + k]: log-likelihood of class k in all of them, the best's 0. */
static void change_finish(const double *sum, int classes, int blocks, double *restrict out)
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

/* Ratio of the likeliest pair of classes for a change with `after` of the blocks behind it, by a rule, given both
 * sides' sums. A difference beyond the classes' own is no more evidence than that. */
static double change_ratio(struct nav_texture_change *c, bool edge, int after)
{
    int classes = c->n.classes, before = c->held - after, width = 4 * classes, at = edge ? 2 * classes : 0;
    double blocks = c->n.share * after * before / (after + before), best = NO_RATIO;
    double *early = c->sum + 2 * width, *late = early + width;
    const double *apart_of = edge ? c->n.edge.apart : c->n.inside.apart;
    change_finish(c->sum + at, classes, before, early);
    change_finish(c->sum + width + at, classes, after, late);
    for (int k = 0; k < classes; k++) {
        for (int j = 0; j < classes; j++) {
            double apart = apart_of[k * classes + j], moved = late[j] - late[k] - early[j] + early[k];
            double named = NAMED * (early[classes + k] + late[classes + j]);
            double here = blocks * ((moved < apart ? moved : apart) - 0.5 * apart) + named;
            if (j != k && here > best)
                best = here;
        }
    }
    return best;
}

/* Moves a block from one side of the change to the other. */
static void change_move(const struct nav_texture_change *c, int block, double *restrict early, double *restrict late)
{
    int width = 4 * c->n.classes;
    const double *row = c->block + (size_t)width * (size_t)block;
    for (int k = 0; k < width; k++) {
        early[k] -= row[k];
        late[k] += row[k];
    }
}

/* The likeliest change among the blocks held: at the edge, if there is one, else anywhere. Returns its ratio, and how
 * many blocks lie behind it. */
static double change_likeliest(struct nav_texture_change *c, int *after)
{
    double *early = c->sum, *late = early + 4 * (size_t)c->n.classes, *none = late + 4 * (size_t)c->n.classes;
    double best = NO_RATIO;
    bool edge = c->behind != NO_EDGE;
    memset(c->sum, 0, 16 * (size_t)c->n.classes * sizeof *c->sum);
    for (int b = 0; b < c->held; b++) /* all blocks into `early`: what leaves the other side comes to this one */
        change_move(c, b, none, early);
    for (int a = 1; a <= MOST && 2 * a <= c->held; a++) {
        change_move(c, c->held - a, early, late);
        if (a < LEAST || (edge && a != c->behind))
            continue;
        double here = change_ratio(c, edge, a) + (edge ? c->n.limit - AT_EDGE : 0.0);
        if (here > best) {
            best = here;
            *after = a;
        }
    }
    return best;
}

double nav_texture_change_weigh(struct nav_texture_change *c, const double *block, int *after)
{
    bool edge = c->behind != NO_EDGE;
    *after = 0;
    if (edge && c->behind++ < 0)
        return NO_RATIO;
    change_take(c, block);
    double best = change_likeliest(c, after);
    if (best > c->n.limit)
        change_keep_last(c, edge ? 0 : *after);
    if (c->behind == MOST)
        nav_texture_change_reset(c);
    return best;
}
