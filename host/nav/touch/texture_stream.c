#include "texture_stream.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "texture_catch.h"
#include "texture_span.h"

#define HELD_WINDOWS 20 /* a tip held for longer, 2 s at 100 ms, has a new rest */
#define SINCE_LONG (1 << 30)
#define BAD_SHARE_MOST 0.25 /* of a window; with more, its spectrum is that of the gaps */

struct nav_texture_stream {
    struct nav_texture_rules rules; /* its pointers are the stream's own, but for what is lent */
    struct nav_texture_rung *rung[NAV_TEXTURE_RUNGS_MAX];
    double unknown[NAV_TEXTURE_RUNGS_MAX], border[NAV_TEXTURE_RUNGS_MAX];
    struct nav_texture_span *span;
    double *limits;  /* [6][channels] the stream's own */
    double *raw;     /* [room][channels] samples since the last decision */
    double *clean;   /* [room][channels] */
    double *half[3]; /* [classes] evidence of the window before's second half, of the first and the second half */
    double *before;  /* [classes] evidence of the window before */
    double *block;   /* [a block's length][channels] samples since the last block */
    int room, held, blocked;
    int since; /* samples since the surface changed, or SINCE_LONG */
    bool has_before;
    int half_rung, before_rung;
    int kind; /* likeliest class of the windows in a row that are judged together, or NAV_TEXTURE_UNKNOWN */
    struct nav_texture_catch edge; /* its level is the sixth row of limits */
};

static bool lengths_ok(const struct nav_texture_rules *r)
{
    if (r->rungs < 1 || r->rungs > NAV_TEXTURE_RUNGS_MAX || r->window < 2 || r->window > NAV_TEXTURE_WINDOW_MAX)
        return false;
    if (r->step < 0 || (r->step > 0 && (r->patience < r->step || r->patience > NAV_TEXTURE_WINDOW_MAX)))
        return false;
    for (int i = 1; i < r->rungs; i++) {
        if (nav_texture_rung_length(r->rung[i]) <= nav_texture_rung_length(r->rung[i - 1]))
            return false;
    }
    return r->channels >= 1 && r->classes >= 1 && r->limits.channels == r->channels;
}

static const double *own_limit(double *to, const double *from, int channels)
{
    return from ? memcpy(to, from, (size_t)channels * sizeof *to) : NULL;
}

static bool allocate(struct nav_texture_stream *s)
{
    size_t channels = (size_t)s->rules.channels, classes = (size_t)s->rules.classes;
    s->span = nav_texture_span_new(&s->rules);
    s->limits = calloc(6 * channels, sizeof *s->limits);
    s->raw = calloc((size_t)s->room * channels, sizeof *s->raw);
    s->clean = calloc((size_t)s->room * channels, sizeof *s->clean);
    s->before = calloc(classes, sizeof *s->before);
    size_t block = s->rules.change ? (size_t)nav_texture_change_length(s->rules.change) : 1;
    s->block = calloc(block * channels, sizeof *s->block);
    bool ok = s->block && s->span && s->limits && s->raw && s->clean && s->before;
    for (int i = 0; i < 3; i++) {
        s->half[i] = calloc(classes, sizeof *s->half[i]);
        ok = ok && s->half[i];
    }
    return ok;
}

static void own_limits(struct nav_texture_stream *s)
{
    memcpy(s->unknown, s->rules.unknown, (size_t)s->rules.rungs * sizeof *s->unknown);
    memcpy(s->border, s->rules.border, (size_t)s->rules.rungs * sizeof *s->border);
    memcpy(s->rung, s->rules.rung, (size_t)s->rules.rungs * sizeof *s->rung);
    s->rules.rung = s->rung;
    s->rules.unknown = s->unknown;
    s->rules.border = s->border;
    struct nav_texture_limits *l = &s->rules.limits;
    int channels = l->channels;
    l->spike = own_limit(s->limits, l->spike, channels);
    l->still = own_limit(s->limits + channels, l->still, channels);
    l->low = own_limit(s->limits + 2 * channels, l->low, channels);
    l->high = own_limit(s->limits + 3 * channels, l->high, channels);
    l->span = own_limit(s->limits + 4 * channels, l->span, channels);
    s->edge = (struct nav_texture_catch){.channels = channels,
                                         .span = l->span,
                                         .level = s->limits + 5 * channels,
                                         .patience = (long)HELD_WINDOWS * s->rules.window};
}

struct nav_texture_stream *nav_texture_stream_new(const struct nav_texture_rules *rules)
{
    struct nav_texture_stream *s = lengths_ok(rules) ? calloc(1, sizeof *s) : NULL;
    if (!s)
        return NULL;
    s->rules = *rules;
    s->room = rules->step > 0 ? rules->patience : rules->window;
    if (!allocate(s)) {
        nav_texture_stream_free(s);
        return NULL;
    }
    own_limits(s);
    nav_texture_stream_reset(s);
    return s;
}

void nav_texture_stream_free(struct nav_texture_stream *s)
{
    if (!s)
        return;
    nav_texture_span_free(s->span);
    free(s->limits);
    free(s->raw);
    free(s->clean);
    free(s->before);
    free(s->block);
    for (int i = 0; i < 3; i++)
        free(s->half[i]);
    free(s);
}

/* The windows to come are not judged together with those before. */
static void new_surface(struct nav_texture_stream *s)
{
    s->kind = NAV_TEXTURE_UNKNOWN;
    if (s->rules.strange)
        nav_texture_strange_reset(s->rules.strange);
}

void nav_texture_stream_reset(struct nav_texture_stream *s)
{
    s->held = s->blocked = 0;
    s->since = SINCE_LONG;
    s->has_before = false;
    if (s->rules.change)
        nav_texture_change_keep(s->rules.change, 0);
    new_surface(s);
    s->edge.known = s->edge.held = false;
}

/* Whether two stretches, judged at this rung, are of two surfaces: no class explains both. */
static bool differ(const struct nav_texture_stream *s, int rung, const double *a, const double *b)
{
    double shared = -INFINITY;
    for (int k = 0; k < s->rules.classes; k++)
        shared = fmax(shared, a[k] + b[k]);
    return rung >= 0 && -shared > s->rules.border[rung];
}

static void swap(double **a, double **b)
{
    double *kept = *a;
    *a = *b;
    *b = kept;
}

/* Judges both halves of n samples alone; returns their rung. */
static int judge_halves(struct nav_texture_stream *s, const double *from, int n)
{
    int first = n / 2, later = n - first;
    const double *middle = from + (size_t)first * (size_t)s->rules.channels;
    double distance;
    int one = nav_texture_span_judge(s->span, from, first, s->half[1], &distance);
    int two = nav_texture_span_judge(s->span, middle, later, s->half[2], &distance);
    return one == two ? one : -1;
}

/* Two views of the same samples, the whole and its halves, err differently: their mean errs less than either. */
static void blend(const struct nav_texture_stream *s, double *loglik)
{
    double best = -INFINITY, both = 0.5 * pow(2.0, s->rules.growth);
    for (int k = 0; k < s->rules.classes; k++) {
        loglik[k] = 0.5 * (loglik[k] + both * (s->half[1][k] + s->half[2][k])) * s->rules.together;
        best = fmax(best, loglik[k]);
    }
    for (int k = 0; k < s->rules.classes; k++)
        loglik[k] -= best;
}

/* Looks for a border between half and half, between window and window, and between the window before and the later
 * half, which hold nothing of the other surface if the border lies in the earlier half; when the halves differ, what
 * counts is the later one. The halves and the window become those before. */
static bool find_border(struct nav_texture_stream *s, double *loglik, int rung, int half_rung)
{
    bool inside = differ(s, half_rung, s->half[1], s->half[2]);
    bool since = s->has_before && ((s->half_rung == half_rung && differ(s, half_rung, s->half[0], s->half[1])) ||
                                   (s->before_rung == rung && differ(s, rung, s->before, loglik)) ||
                                   differ(s, half_rung, s->before, s->half[2]));
    size_t bytes = (size_t)s->rules.classes * sizeof *loglik;
    if (inside)
        memcpy(loglik, s->half[2], bytes);
    memcpy(s->before, loglik, bytes);
    s->before_rung = inside ? -1 : rung;
    s->half_rung = half_rung;
    swap(&s->half[0], &s->half[2]);
    s->has_before = true;
    return inside || since;
}

/* Confidence of the likeliest class under equal priors, and which. */
static double best(const double *loglik, int classes, int *label)
{
    double sum = 0.0;
    *label = 0;
    for (int k = 0; k < classes; k++) {
        if (loglik[k] > loglik[*label])
            *label = k;
    }
    for (int k = 0; k < classes; k++)
        sum += exp(loglik[k] - loglik[*label]);
    return 1.0 / sum;
}

static void no_evidence(struct nav_texture_stream *s, struct nav_texture_decision *d, double *loglik)
{
    memset(loglik, 0, (size_t)s->rules.classes * sizeof *loglik);
    d->label = NAV_TEXTURE_UNKNOWN;
    d->confidence = 0.0;
    s->has_before = false;
    new_surface(s);
}

static bool unreadable(const struct nav_texture_health *h, int n)
{
    return (double)h->bad > BAD_SHARE_MOST * n || h->still > 0 || h->railed > 0;
}

/* How far beyond every trained surface this window lies, or the windows in a row that it ends: above 1 is never
 * trained. */
static double strangeness(struct nav_texture_stream *s, double distance, int rung, int n, int kind)
{
    double alone = distance / s->rules.unknown[rung];
    struct nav_texture_strange *strange = s->rules.step > 0 ? NULL : s->rules.strange;
    int count;
    const double *features = nav_texture_rung_features(s->rules.rung[rung], &count);
    if (!strange || n != nav_texture_rung_length(s->rules.rung[rung]) || count != nav_texture_strange_features(strange))
        return alone;
    if (kind != s->kind && s->kind != NAV_TEXTURE_UNKNOWN)
        nav_texture_strange_reset(strange);
    s->kind = kind;
    return fmax(alone, nav_texture_strange_weigh(strange, features));
}

/* A surface that lies beyond every trained one is weak evidence for any of them: the farther, the weaker. */
static bool never_trained(const struct nav_texture_stream *s, double beyond, double *loglik)
{
    for (int k = 0; k < s->rules.classes && beyond > 1.0; k++)
        loglik[k] /= beyond;
    return beyond > 1.0;
}

static bool edge_holds(struct nav_texture_stream *s, bool sudden)
{
    return nav_texture_catch_follow(&s->edge, s->clean, s->held, s->rules.step > 0 ? s->rules.step : s->held, sudden);
}

/* Whether borders are looked for block by block: then windows and halves that differ are no news. */
static bool watched(const struct nav_texture_stream *s)
{
    return s->rules.step == 0 && s->rules.change;
}

/* Decides on the samples held. Returns whether a sequential decision may stop here. */
static bool decide(struct nav_texture_stream *s, struct nav_texture_decision *d, double *loglik)
{
    memset(d, 0, sizeof *d);
    d->samples = s->held;
    memcpy(s->clean, s->raw, (size_t)s->held * (size_t)s->rules.channels * sizeof *s->clean);
    d->health = nav_texture_clean(s->clean, s->held, &s->rules.limits);
    bool readable = !unreadable(&d->health, s->held);
    if (readable && d->health.railed == 0 && edge_holds(s, d->health.caught > 0))
        d->health.caught = d->health.caught > 0 ? d->health.caught : 1;
    d->border = d->health.caught > 0 && d->health.railed == 0;
    bool cut = s->since < s->held; /* what lies before the border says nothing of the surface now */
    int n = cut ? s->since : s->held, rung = -1;
    const double *from = s->clean + (size_t)(s->held - n) * (size_t)s->rules.channels;
    if (readable && !d->health.caught)
        rung = nav_texture_span_judge(s->span, from, n, loglik, &d->distance);
    d->border = d->border || cut;
    if (rung < 0) {
        no_evidence(s, d, loglik);
        return false;
    }
    int half_rung = judge_halves(s, from, n);
    if (half_rung >= 0)
        blend(s, loglik);
    best(loglik, s->rules.classes, &d->label);
    double beyond = strangeness(s, d->distance, rung, n, d->label);
    bool strange = never_trained(s, beyond, loglik);
    d->confidence = best(loglik, s->rules.classes, &d->label);
    if (s->rules.step > 0 && (d->confidence < s->rules.sure || strange) && s->held < s->room)
        return false;
    bool halves = find_border(s, loglik, rung, half_rung);
    d->border = cut || (halves && !watched(s));
    d->confidence = best(loglik, s->rules.classes, &d->label);
    if (strange)
        d->confidence /= beyond;
    bool unsure = d->confidence < (s->rules.step > 0 ? s->rules.sure : s->rules.doubt);
    if (strange || unsure)
        d->label = NAV_TEXTURE_UNKNOWN;
    return true;
}

/* Whether the block that this sample completes shows that the surface has changed. */
static bool changed(struct nav_texture_stream *s, const double *sample)
{
    struct nav_texture_change *change = s->rules.change;
    size_t channels = (size_t)s->rules.channels;
    s->since += s->since < SINCE_LONG;
    if (!watched(s))
        return false;
    memcpy(s->block + (size_t)s->blocked++ * channels, sample, channels * sizeof *sample);
    int length = nav_texture_change_length(change), after;
    if (s->blocked < length)
        return false;
    s->blocked = 0;
    struct nav_texture_health health = nav_texture_clean(s->block, length, &s->rules.limits);
    if (unreadable(&health, length) || health.caught > 0 || s->edge.held) {
        nav_texture_change_keep(change, 0);
        return false;
    }
    if (!(nav_texture_change_weigh(change, s->block, &after) > nav_texture_change_limit(change)))
        return false;
    nav_texture_change_keep(change, after);
    s->since = after * length;
    s->has_before = false;
    new_surface(s);
    return true;
}

/* Word of a border before the window is full. */
static void notice(struct nav_texture_stream *s, struct nav_texture_decision *d, double *loglik)
{
    memset(d, 0, sizeof *d);
    no_evidence(s, d, loglik);
    d->samples = s->held;
    d->border = d->notice = 1;
}

static bool due(const struct nav_texture_stream *s)
{
    return s->held == s->room || (s->rules.step > 0 && s->held % s->rules.step == 0);
}

long nav_texture_stream_push(struct nav_texture_stream *s, const double *samples, long n, int *decided,
                             struct nav_texture_decision *decision, double *loglik)
{
    size_t channels = (size_t)s->rules.channels;
    *decided = 0;
    for (long i = 0; i < n; i++) {
        memcpy(s->raw + (size_t)s->held++ * channels, samples + (size_t)i * channels, channels * sizeof *s->raw);
        bool news = changed(s, samples + (size_t)i * channels);
        if (news && !due(s)) {
            notice(s, decision, loglik);
            *decided = 1;
            return i + 1;
        }
        if (!due(s))
            continue;
        bool may_stop = decide(s, decision, loglik);
        if (may_stop || s->held == s->room) {
            s->held = 0;
            *decided = 1;
            return i + 1;
        }
    }
    return n;
}
