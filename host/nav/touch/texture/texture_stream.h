/* Texture of one whisker, sample by sample: windows in a row, or as few samples as it takes to be sure.
 *
 * A forward filter over windows in a row gives the probability of each class. Between windows the surface changes with
 * some chance, to each other class alike; a window's evidence then weighs the classes: the first window's whole, that
 * of those behind it by the classifier's factor, for windows of one drive err alike. An edge that holds the tip is no
 * evidence, and behind it the surface may be another. Whether the surface was ever trained is a distance of its own
 * (texture_novelty.h), which decides the label and leaves the probabilities alone.
 */
#ifndef NAV_TEXTURE_STREAM_H
#define NAV_TEXTURE_STREAM_H

#include <stddef.h>

#include "texture_classifier.h"
#include "texture_clean.h"
#include "texture_novelty.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_texture_stream;

enum { NAV_TEXTURE_CLASSIFIERS_MAX = 16, NAV_TEXTURE_WINDOW_MAX = 1 << 20, NAV_TEXTURE_UNKNOWN = -1 };

struct nav_texture_rules {
    int channels, classes;
    int window;      /* samples, from 2 to NAV_TEXTURE_WINDOW_MAX */
    int classifiers; /* at least 1; their windows grow from classifier to classifier */
    struct nav_texture_classifier *const
        *classifier; /* [classifiers] lent for the stream's life; not for use by two threads at a time */
    double hazard;   /* changes of surface per sample, above 0 */
    double doubt;    /* probability of a class below which the answer is "unknown" */
    int step;        /* 0: windows in a row. Else sequential: looks every so many samples, ... */
    double sure;     /* ... answers at this probability, ... */
    int patience;    /* ... and after so many samples in any case */
    struct nav_texture_limits limits;    /* channels as above */
    struct nav_texture_novelty *novelty; /* lent to this stream alone, of the first features of novelty_classifier;
                                            NULL: every surface is taken for a trained one */
    int novelty_classifier;
};

struct nav_texture_decision {
    int label;         /* class, or NAV_TEXTURE_UNKNOWN */
    int best;          /* the likeliest class, whatever the label */
    int samples;       /* that the decision took */
    double confidence; /* probability of the likeliest class, given all since the stream began; 0 without evidence */
    double novelty;    /* distance from all trained surfaces over its limit: above 1 the label is unknown */
    struct nav_texture_health health;
};

/* NULL for impossible rules or without memory; nothing is allocated afterwards. */
struct nav_texture_stream *nav_texture_stream_new(const struct nav_texture_rules *);
void nav_texture_stream_free(struct nav_texture_stream *);

/* Takes samples[n][channels] (raw counts; nan: missing) up to the first decision, and returns how many it took: fewer
 * than n, or *decided set, when there is one. loglik[classes]: what these samples alone say, as log-likelihoods whose
 * largest is 0; all 0 without evidence. */
long nav_texture_stream_push(struct nav_texture_stream *, const double *samples, long n, int *decided,
                             struct nav_texture_decision *decision, double *loglik);

/* Forgets what came before, as after a gap in the data. */
void nav_texture_stream_reset(struct nav_texture_stream *);

/* The filter by itself: the posteriors[rows][classes] after each of so many windows of loglik[rows][classes], each
 * after a change of surface with this chance, from all classes alike; `temper`: factor of all but the first. */
void nav_texture_filter_run(const double *loglik, size_t rows, int classes, double temper, double chance,
                            double *posterior);
/* cffi: end */

/* Its steps. posterior[classes]: all classes alike, as before any window. */
void nav_texture_filter_start(double *posterior, int classes);

/* The surface has changed with this chance, 0 to 1. */
void nav_texture_filter_change(double *posterior, int classes, double chance);

/* Weighs the classes by loglik[classes], whose largest is 0, times `temper`, >= 0. */
void nav_texture_filter_weigh(double *posterior, int classes, const double *loglik, double temper);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
