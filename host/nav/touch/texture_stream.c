#include "texture_stream.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "texture_catch.h"
#include "texture_halves.h"
#include "texture_span.h"
#include "texture_watch.h"

#define HELD_WINDOWS 20 /* a tip held for longer, 2 s at 100 ms, has a new rest */
#define SINCE_LONG (1 << 30)
#define SURE 0.9     /* confidence that names a surface, for which of two windows in a row are of one */
#define RINGING 0.05 /* share of its evidence that a window keeps while the whisker rings */

struct nav_texture_stream {
    struct nav_texture_rules rules; /* its pointers are the stream's own, but for what is lent */
    struct nav_texture_classifier *classifier[NAV_TEXTURE_CLASSIFIERS_MAX];
    double border[NAV_TEXTURE_CLASSIFIERS_MAX];
    struct nav_texture_span *span;
    double *limits; /* [6][channels] the stream's own */
    double *raw;    /* [room][channels] samples since the last decision */
    double *clean;  /* [room][channels] */
    int room, held;
    int since; /* samples since the surface changed, or SINCE_LONG */
    struct nav_texture_halves halves;
    struct nav_texture_watch watch;
    int kind;      /* surface of the windows in a row that are judged together, or NAV_TEXTURE_UNKNOWN */
    int named;     /* surface last named with confidence, or NAV_TEXTURE_UNKNOWN, ... */
    int named_for; /* ... and for how many samples in a row, counted up to where it becomes `kind` */
    double beyond; /* novelty score of the windows in a row, 0 before the first */
    double *apart; /* [novelty's length][channels] samples since its last window, then [classes]; unused if aligned */
    int apart_held;
    struct nav_texture_catch edge; /* its level is the sixth row of limits */
};

static bool classifiers_ok(const struct nav_texture_rules *r)
{
    if (r->classifiers < 1 || r->classifiers > NAV_TEXTURE_CLASSIFIERS_MAX)
        return false;
    for (int i = 1; i < r->classifiers; i++) {
        if (nav_texture_classifier_length(r->classifier[i]) <= nav_texture_classifier_length(r->classifier[i - 1]))
            return false;
    }
    return true;
}

static bool lengths_ok(const struct nav_texture_rules *r)
{
    bool sequential = r->told >= 0.0 && r->patience >= r->step && r->patience <= NAV_TEXTURE_WINDOW_MAX;
    return r->window >= 2 && r->window <= NAV_TEXTURE_WINDOW_MAX && r->step >= 0 && (r->step == 0 || sequential);
}

static bool novelty_ok(const struct nav_texture_rules *r)
{
    int at = r->novelty_classifier;
    return at >= 0 && at < r->classifiers &&
           nav_texture_novelty_features(r->novelty) == nav_texture_classifier_count(r->classifier[at]);
}

static bool rules_ok(const struct nav_texture_rules *r)
{
    if (r->channels < 1 || r->classes < 1 || r->limits.channels != r->channels || !classifiers_ok(r) || !lengths_ok(r))
        return false;
    if (r->ringdown && (!r->change || nav_texture_ringdown_length(r->ringdown) != nav_texture_change_length(r->change)))
        return false;
    return !r->novelty || novelty_ok(r);
}

static const double *own_limit(double *to, const double *from, int channels)
{
    return from ? memcpy(to, from, (size_t)channels * sizeof *to) : NULL;
}

/* Samples of a window that novelty is judged by; 0 without. */
static int novelty_length(const struct nav_texture_stream *s)
{
    return s->rules.novelty ? nav_texture_classifier_length(s->rules.classifier[s->rules.novelty_classifier]) : 0;
}

/* Whether decisions are of just the windows that novelty is judged by. */
static bool aligned(const struct nav_texture_stream *s)
{
    return s->rules.step == 0 && s->rules.window == novelty_length(s);
}

static bool allocate(struct nav_texture_stream *s)
{
    size_t channels = (size_t)s->rules.channels;
    s->apart = calloc((size_t)novelty_length(s) * channels + (size_t)s->rules.classes, sizeof *s->apart);
    s->span = nav_texture_span_new(&s->rules);
    s->limits = calloc(6 * channels, sizeof *s->limits);
    s->raw = calloc((size_t)s->room * channels, sizeof *s->raw);
    s->clean = calloc((size_t)s->room * channels, sizeof *s->clean);
    bool halves = nav_texture_halves_make(&s->halves, &s->rules, s->border);
    bool watch = nav_texture_watch_make(&s->watch, &s->rules, &s->rules.limits);
    return halves && watch && s->apart && s->span && s->limits && s->raw && s->clean;
}

static void own_limits(struct nav_texture_stream *s)
{
    memcpy(s->border, s->rules.border, (size_t)s->rules.classifiers * sizeof *s->border);
    memcpy(s->classifier, s->rules.classifier, (size_t)s->rules.classifiers * sizeof *s->classifier);
    s->rules.classifier = s->classifier;
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
    struct nav_texture_stream *s = rules_ok(rules) ? calloc(1, sizeof *s) : NULL;
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
    free(s->apart);
    free(s->raw);
    free(s->clean);
    nav_texture_watch_free(&s->watch);
    nav_texture_halves_free(&s->halves);
    free(s);
}

/* The windows to come are not judged together with those before. */
static void new_surface(struct nav_texture_stream *s)
{
    s->kind = s->named = NAV_TEXTURE_UNKNOWN;
    s->named_for = 0;
    s->beyond = 0.0;
    s->apart_held = 0;
    if (s->rules.novelty)
        nav_texture_novelty_reset(s->rules.novelty);
}

void nav_texture_stream_reset(struct nav_texture_stream *s)
{
    s->held = 0;
    s->since = SINCE_LONG;
    s->halves.has_before = false;
    nav_texture_watch_reset(&s->watch);
    new_surface(s);
    s->edge.known = s->edge.held = false;
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
    s->halves.has_before = false;
    new_surface(s);
}

/* Judges the window that a classifier has just reduced to features, together with those before it. */
static void weigh_novelty(struct nav_texture_stream *s)
{
    const double *features = nav_texture_classifier_features(s->rules.classifier[s->rules.novelty_classifier]);
    s->beyond = nav_texture_novelty_weigh(s->rules.novelty, features);
}

/* Novelty score of the windows in a row. Another surface, named with confidence for longer than one window, begins a
 * new row: one that was never trained takes the names of its neighbours in turn. */
static void follow_row(struct nav_texture_stream *s, const struct nav_texture_decision *d, int n)
{
    if (d->confidence > SURE) {
        int fresh = s->rules.step > 0 ? s->rules.step : s->held;
        s->named_for = (d->label == s->named ? s->named_for : 0) + fresh;
        s->named = d->label;
    }
    if (s->named == s->kind) {
        s->named_for = 0;
    } else if (s->named_for > novelty_length(s)) {
        int named = s->named;
        if (s->kind != NAV_TEXTURE_UNKNOWN)
            new_surface(s);
        s->kind = s->named = named;
        s->named_for = 0;
    }
    if (aligned(s) && n == s->held)
        weigh_novelty(s);
}

/* A surface that lies beyond every trained one is weak evidence for any of them: the farther, the weaker. */
static bool never_trained(const struct nav_texture_stream *s, double *loglik)
{
    for (int k = 0; k < s->rules.classes && s->beyond > 1.0; k++)
        loglik[k] /= s->beyond;
    return s->beyond > 1.0;
}

/* A whisker that still rings from another surface says little of this one. Windows so long that the ringing is a small
 * part of them are taken as they are. */
static bool rings(const struct nav_texture_stream *s, double *loglik)
{
    const struct nav_texture_ringdown *ringdown = s->rules.step == 0 ? s->rules.ringdown : NULL;
    bool ringing = ringdown && s->held <= NAV_TEXTURE_RINGDOWN_MOST * nav_texture_ringdown_length(ringdown) &&
                   nav_texture_ringdown_rings(ringdown);
    for (int k = 0; k < s->rules.classes && ringing; k++)
        loglik[k] *= RINGING;
    return ringing;
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

/* Cleans the samples held. Returns whether they say anything of a surface. */
static bool clean(struct nav_texture_stream *s, struct nav_texture_decision *d)
{
    memcpy(s->clean, s->raw, (size_t)s->held * (size_t)s->rules.channels * sizeof *s->clean);
    d->health = nav_texture_clean(s->clean, s->held, &s->rules.limits);
    bool readable = !nav_texture_unreadable(&d->health, s->held);
    if (readable && d->health.railed == 0 && edge_holds(s, d->health.caught > 0))
        d->health.caught = d->health.caught > 0 ? d->health.caught : 1;
    return readable && !d->health.caught;
}

/* Whether a sequential decision takes more samples: up to one window for a surface never trained, and to the last for
 * one that is not named surely. */
static bool goes_on(const struct nav_texture_stream *s, double confidence, bool untrained)
{
    int most = untrained ? s->rules.window : s->room;
    return s->rules.step > 0 && s->held < most && (untrained || confidence < s->rules.sure);
}

/* Label and confidence. Samples are taken until they look sure, so a sequential decision's evidence is less than it
 * looks: `told` of it is kept. */
static void answer(const struct nav_texture_stream *s, struct nav_texture_decision *d, double *loglik, bool unknown)
{
    int classes = s->rules.classes;
    double least = s->rules.step > 0 ? s->rules.sure : s->rules.doubt;
    bool unsure = best(loglik, classes, &d->label) < least;
    for (int k = 0; k < classes && s->rules.step > 0; k++)
        loglik[k] *= s->rules.told;
    d->confidence = best(loglik, classes, &d->label) / fmax(s->beyond, 1.0);
    if (unknown || unsure || s->beyond > 1.0)
        d->label = NAV_TEXTURE_UNKNOWN;
}

/* Decides on the samples held. Returns whether a sequential decision may stop here. */
static bool decide(struct nav_texture_stream *s, struct nav_texture_decision *d, double *loglik)
{
    *d = (struct nav_texture_decision){.samples = s->held};
    bool cut = s->since < s->held; /* what lies before the border says nothing of the surface now */
    int n = cut ? s->since : s->held;
    const double *from = s->clean + (size_t)(s->held - n) * (size_t)s->rules.channels;
    int classifier = clean(s, d) ? nav_texture_span_judge(s->span, from, n, loglik) : -1;
    d->border = cut || (d->health.caught > 0 && d->health.railed == 0);
    if (classifier < 0) {
        no_evidence(s, d, loglik);
        return false;
    }
    int half_classifier = nav_texture_halves_judge(&s->halves, s->span, from, n, loglik);
    d->confidence = best(loglik, s->rules.classes, &d->label);
    follow_row(s, d, n);
    d->novelty = s->beyond;
    bool untrained = never_trained(s, loglik);
    if (goes_on(s, best(loglik, s->rules.classes, &d->label), untrained))
        return false;
    bool halves = nav_texture_halves_border(&s->halves, loglik, classifier, half_classifier);
    d->border = cut || (halves && !watched(s));
    answer(s, d, loglik, rings(s, loglik));
    return true;
}

/* Whether this sample shows that the surface has changed. */
static bool changed(struct nav_texture_stream *s, const double *sample)
{
    s->since += s->since < SINCE_LONG;
    int after = watched(s) ? nav_texture_watch_take(&s->watch, sample, s->edge.held) : 0;
    if (after == 0)
        return false;
    s->since = after;
    s->halves.has_before = false;
    new_surface(s);
    return true;
}

/* Windows of novelty's own, where decisions are of others. */
static void follow_novelty(struct nav_texture_stream *s, const double *sample)
{
    int length = novelty_length(s), channels = s->rules.channels;
    memcpy(s->apart + (size_t)s->apart_held++ * (size_t)channels, sample, (size_t)channels * sizeof *sample);
    if (s->apart_held < length)
        return;
    s->apart_held = 0;
    struct nav_texture_health health = nav_texture_clean(s->apart, length, &s->rules.limits);
    if (nav_texture_unreadable(&health, length) || health.caught > 0 || s->edge.held)
        return;
    nav_texture_classifier_judge(s->rules.classifier[s->rules.novelty_classifier], s->apart,
                                 s->apart + (size_t)length * (size_t)channels);
    weigh_novelty(s);
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
        if (s->rules.novelty && !aligned(s))
            follow_novelty(s, samples + (size_t)i * channels);
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
