#include "texture_stream.h"

#include "texture_slab.h"

#define SURE 0.9            /* probability of another class at which windows are no longer of the same row */
#define MOVED 0.5           /* chance that an edge that holds the tip is the border of another surface */
#define TINY 1e-300         /* keeps a sum of probabilities above 0 where the likeliest class has none */
#define BAD_SHARE_MOST 0.25 /* of a window; with more, its spectrum is that of the gaps */

struct nav_texture_stream {
    struct nav_texture_rules rules; /* its pointers are the stream's own, but for what is lent */
    struct nav_texture_classifier *classifier[NAV_TEXTURE_CLASSIFIERS_MAX];
    double *raw;   /* [room][channels] samples since the last decision */
    double *clean; /* [room][channels] */
    double *apart; /* [novelty's length][channels] samples since its last window; unused if aligned */
    double *posterior, *ahead, *part; /* [classes] at the last decision; with the samples since; of one window */
    int room, held, apart_held;
    bool begun;   /* there was evidence before the samples held */
    int kind;     /* class of the windows in a row that novelty is judged by, or NAV_TEXTURE_UNKNOWN */
    double novel; /* how novel they are */
};

void nav_texture_filter_start(double *posterior, int classes)
{
    for (int k = 0; k < classes; k++)
        posterior[k] = 1.0 / classes;
}

void nav_texture_filter_change(double *posterior, int classes, double chance)
{
    for (int k = 0; k < classes && classes > 1; k++)
        posterior[k] = (1.0 - chance) * posterior[k] + chance * (1.0 - posterior[k]) / (classes - 1);
}

void nav_texture_filter_weigh(double *posterior, int classes, const double *loglik, double temper)
{
    double sum = 0.0;
    for (int k = 0; k < classes; k++)
        sum += posterior[k] = posterior[k] * exp(temper * loglik[k]) + TINY;
    for (int k = 0; k < classes; k++)
        posterior[k] /= sum;
}

void nav_texture_filter_run(const double *loglik, size_t rows, int classes, double temper, double chance,
                            double *posterior)
{
    for (size_t i = 0; i < rows; i++, loglik += classes, posterior += classes) {
        if (i == 0)
            nav_texture_filter_start(posterior, classes);
        else
            memcpy(posterior, posterior - classes, (size_t)classes * sizeof *posterior);
        nav_texture_filter_change(posterior, classes, chance);
        nav_texture_filter_weigh(posterior, classes, loglik, i == 0 ? 1.0 : temper);
    }
}

static bool stream_classifiers_ok(const struct nav_texture_rules *r)
{
    if (r->classifiers < 1 || r->classifiers > NAV_TEXTURE_CLASSIFIERS_MAX)
        return false;
    for (int i = 1; i < r->classifiers; i++) {
        if (nav_texture_classifier_length(r->classifier[i]) <= nav_texture_classifier_length(r->classifier[i - 1]))
            return false;
    }
    return true;
}

static bool stream_numbers_ok(const struct nav_texture_rules *r)
{
    bool sequential = r->patience >= r->step && r->patience <= NAV_TEXTURE_WINDOW_MAX;
    return r->window >= 2 && r->window <= NAV_TEXTURE_WINDOW_MAX && r->step >= 0 && (r->step == 0 || sequential) &&
           r->hazard > 0.0 && isfinite(r->hazard);
}

static bool stream_novelty_ok(const struct nav_texture_rules *r)
{
    int at = r->novelty_classifier;
    return at >= 0 && at < r->classifiers &&
           nav_texture_novelty_features(r->novelty) <= nav_texture_classifier_count(r->classifier[at]);
}

static bool stream_rules_ok(const struct nav_texture_rules *r)
{
    return r->channels >= 1 && r->classes >= 1 && r->limits.channels == r->channels && stream_classifiers_ok(r) &&
           stream_numbers_ok(r) && (!r->novelty || stream_novelty_ok(r));
}

/* Samples of a window that novelty is judged by; 0 without. */
static int stream_novelty_length(const struct nav_texture_stream *s)
{
    return s->rules.novelty ? nav_texture_classifier_length(s->rules.classifier[s->rules.novelty_classifier]) : 0;
}

/* Whether decisions are of just the windows that novelty is judged by. */
static bool stream_aligned(const struct nav_texture_stream *s)
{
    return s->rules.step == 0 && s->rules.window == stream_novelty_length(s);
}

static void stream_copy_limit(struct nav_texture_slab *m, const double **limit, int channels)
{
    if (*limit)
        nav_texture_slab_copy(m, limit, (size_t)channels);
}

static void stream_place(void *of, struct nav_texture_slab *m)
{
    struct nav_texture_stream *s = of;
    struct nav_texture_limits *l = &s->rules.limits;
    size_t channels = (size_t)s->rules.channels, classes = (size_t)s->rules.classes;
    const double **limits[] = {&l->spike, &l->still, &l->low, &l->high, &l->span};
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++)
        stream_copy_limit(m, limits[i], s->rules.channels);
    s->raw = nav_texture_slab_cut(m, (size_t)s->room * channels);
    s->clean = nav_texture_slab_cut(m, (size_t)s->room * channels);
    s->apart = nav_texture_slab_cut(m, (size_t)stream_novelty_length(s) * channels);
    s->posterior = nav_texture_slab_cut(m, classes);
    s->ahead = nav_texture_slab_cut(m, classes);
    s->part = nav_texture_slab_cut(m, classes);
}

struct nav_texture_stream *nav_texture_stream_new(const struct nav_texture_rules *rules)
{
    if (!stream_rules_ok(rules))
        return NULL;
    struct nav_texture_stream like = {.rules = *rules, .room = rules->step > 0 ? rules->patience : rules->window};
    memcpy(like.classifier, rules->classifier, (size_t)rules->classifiers * sizeof *like.classifier);
    like.rules.classifier = like.classifier;
    struct nav_texture_stream *s = nav_texture_slab_new(&like, sizeof like, stream_place);
    if (!s)
        return NULL;
    s->rules.classifier = s->classifier;
    nav_texture_stream_reset(s);
    return s;
}

void nav_texture_stream_free(struct nav_texture_stream *s)
{
    free(s);
}

/* The windows to come are not judged together with those before. */
static void stream_new_row(struct nav_texture_stream *s)
{
    s->kind = NAV_TEXTURE_UNKNOWN;
    s->novel = 0.0;
    s->apart_held = 0;
    if (s->rules.novelty)
        nav_texture_novelty_reset(s->rules.novelty);
}

void nav_texture_stream_reset(struct nav_texture_stream *s)
{
    s->held = 0;
    s->begun = false;
    nav_texture_filter_start(s->posterior, s->rules.classes);
    stream_new_row(s);
}

/* Whether n samples say nothing of a floor: too many of the records bad, or a channel stuck or railed. */
static bool stream_unreadable(const struct nav_texture_health *h, int n)
{
    return (double)h->bad > BAD_SHARE_MOST * n || h->still > 0 || h->railed > 0;
}

/* Cleans the samples held. Returns whether they say anything of a surface. */
static bool stream_clean(struct nav_texture_stream *s, struct nav_texture_decision *d)
{
    memcpy(s->clean, s->raw, (size_t)s->held * (size_t)s->rules.channels * sizeof *s->clean);
    d->health = nav_texture_clean(s->clean, s->held, &s->rules.limits);
    return !stream_unreadable(&d->health, s->held) && d->health.caught == 0;
}

/* What the samples held say of each class, the best's 0: the longest classifier that fits covers them in evenly spaced
 * windows. Evidence is that of as many windows as they fill, of which the first counts whole if nothing was before it.
 * False when they are shorter than every classifier. */
static bool stream_evidence(struct nav_texture_stream *s, double *loglik, double *factor)
{
    int at = s->rules.classifiers - 1, classes = s->rules.classes, n = s->held;
    while (at >= 0 && nav_texture_classifier_length(s->classifier[at]) > n)
        at--;
    memset(loglik, 0, (size_t)classes * sizeof *loglik);
    if (at < 0)
        return false;
    int length = nav_texture_classifier_length(s->classifier[at]), windows = (n + length - 1) / length;
    for (int w = 0; w < windows; w++) {
        long start = windows > 1 ? (long)(n - length) * w / (windows - 1) : 0;
        nav_texture_classifier_judge(s->classifier[at], s->clean + start * s->rules.channels, s->part);
        for (int k = 0; k < classes; k++)
            loglik[k] += s->part[k];
    }
    double best = -INFINITY, filled = (double)n / length;
    double behind = nav_texture_classifier_behind(s->classifier[at]);
    for (int k = 0; k < classes; k++)
        best = fmax(best, loglik[k]);
    for (int k = 0; k < classes; k++)
        loglik[k] = (loglik[k] - best) * filled / windows;
    *factor = s->begun ? behind : (1.0 + behind * (filled - 1.0)) / filled;
    return true;
}

static int stream_likeliest(const double *posterior, int classes)
{
    int best = 0;
    for (int k = 1; k < classes; k++)
        best = posterior[k] > posterior[best] ? k : best;
    return best;
}

/* Judges the window that a classifier has just reduced to features, together with those before it. */
static void stream_weigh_novelty(struct nav_texture_stream *s)
{
    const double *features = nav_texture_classifier_features(s->classifier[s->rules.novelty_classifier]);
    s->novel = nav_texture_novelty_weigh(s->rules.novelty, features);
}

/* Whether the row of windows is of a surface never trained. Where the filter is sure of another class, a row begins. */
static void stream_follow_row(struct nav_texture_stream *s, int best)
{
    if (s->ahead[best] > SURE && best != s->kind) {
        if (s->kind != NAV_TEXTURE_UNKNOWN)
            stream_new_row(s);
        s->kind = best;
    }
    if (stream_aligned(s))
        stream_weigh_novelty(s);
}

/* Chance that the surface changed within n samples. */
static double stream_chance(const struct nav_texture_stream *s, int n)
{
    return -expm1(-s->rules.hazard * n);
}

static void stream_no_evidence(struct nav_texture_stream *s, struct nav_texture_decision *d, double *loglik)
{
    memset(loglik, 0, (size_t)s->rules.classes * sizeof *loglik);
    d->label = NAV_TEXTURE_UNKNOWN;
    d->best = stream_likeliest(s->ahead, s->rules.classes);
    stream_new_row(s);
}

static void stream_answer(const struct nav_texture_stream *s, struct nav_texture_decision *d)
{
    double least = s->rules.step > 0 ? s->rules.sure : s->rules.doubt;
    d->novelty = s->novel;
    d->confidence = s->ahead[d->best];
    d->label = d->confidence >= least && s->novel <= 1.0 ? d->best : NAV_TEXTURE_UNKNOWN;
}

/* Decides on the samples held. Returns whether a sequential decision may stop here. */
static bool stream_decide(struct nav_texture_stream *s, struct nav_texture_decision *d, double *loglik)
{
    int classes = s->rules.classes;
    double factor;
    *d = (struct nav_texture_decision){.samples = s->held};
    bool readable = stream_clean(s, d), caught = d->health.caught > 0 && d->health.railed == 0;
    memcpy(s->ahead, s->posterior, (size_t)classes * sizeof *s->ahead);
    nav_texture_filter_change(s->ahead, classes, caught ? MOVED : stream_chance(s, s->held));
    if (!readable || !stream_evidence(s, loglik, &factor)) {
        stream_no_evidence(s, d, loglik);
        return false;
    }
    nav_texture_filter_weigh(s->ahead, classes, loglik, factor);
    d->best = stream_likeliest(s->ahead, classes);
    stream_follow_row(s, d->best);
    stream_answer(s, d);
    return s->rules.step == 0 || d->confidence >= s->rules.sure;
}

/* Windows of novelty's own, where decisions are of others. */
static void stream_follow_novelty(struct nav_texture_stream *s, const double *sample)
{
    int length = stream_novelty_length(s), channels = s->rules.channels;
    memcpy(s->apart + (size_t)s->apart_held++ * (size_t)channels, sample, (size_t)channels * sizeof *sample);
    if (s->apart_held < length)
        return;
    s->apart_held = 0;
    struct nav_texture_health health = nav_texture_clean(s->apart, length, &s->rules.limits);
    if (stream_unreadable(&health, length) || health.caught > 0)
        return;
    nav_texture_classifier_judge(s->classifier[s->rules.novelty_classifier], s->apart, s->part);
    stream_weigh_novelty(s);
}

static bool stream_due(const struct nav_texture_stream *s)
{
    return s->held == s->room || (s->rules.step > 0 && s->held % s->rules.step == 0);
}

/* Takes one sample; whether that makes a decision. */
static bool stream_take(struct nav_texture_stream *s, const double *sample, struct nav_texture_decision *d,
                        double *loglik)
{
    size_t channels = (size_t)s->rules.channels;
    memcpy(s->raw + (size_t)s->held++ * channels, sample, channels * sizeof *sample);
    if (s->rules.novelty && !stream_aligned(s))
        stream_follow_novelty(s, sample);
    if (!stream_due(s) || (!stream_decide(s, d, loglik) && s->held < s->room))
        return false;
    memcpy(s->posterior, s->ahead, (size_t)s->rules.classes * sizeof *s->posterior);
    s->begun = s->begun || d->confidence > 0.0;
    s->held = 0;
    return true;
}

long nav_texture_stream_push(struct nav_texture_stream *s, const double *samples, long n, int *decided,
                             struct nav_texture_decision *decision, double *loglik)
{
    *decided = 0;
    for (long i = 0; i < n; i++) {
        if (stream_take(s, samples + (size_t)i * (size_t)s->rules.channels, decision, loglik)) {
            *decided = 1;
            return i + 1;
        }
    }
    return n;
}
