/* Surfaces never trained: windows in a row under a hierarchical Gaussian model of a window's features.
 *
 * A window's features are the mean of its surface, plus what the recording adds (speed, load, the whisker) and stays
 * for all windows of a row, plus the noise of one window. Of a trained surface the mean is known; of one never trained
 * it is drawn from the spread of the trained ones' means. The mean of the windows in a row is weighed as either. Axes
 * are turned so that recordings and windows spread independently along each.
 */
#ifndef NAV_TEXTURE_NOVELTY_H
#define NAV_TEXTURE_NOVELTY_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_texture_novelty;

enum { NAV_TEXTURE_NOVELTY_STEPS = 5 };

/* F: features, K: classes. All arrays are copied. Rows K of `mean` and `recording` are of a surface never trained. */
struct nav_texture_novelty_numbers {
    int classes, features;
    const double *turn;      /* [F][F] row f: what feature f adds along each axis */
    const double *mean;      /* [K + 1][F] turned */
    const double *recording; /* [K + 1][F] variance of recordings about the mean, >= 0 */
    const double *noise;     /* [F] variance of one window within a recording, > 0 */
    const double *limit;     /* [NAV_TEXTURE_NOVELTY_STEPS] nats, of the mean of 1, 2, 4, 8 and 16 windows or more */
    double scale;            /* nats of the ratio, > 0, that are one nat of the answer */
};

/* NULL when a size or number is out of range or memory is short. */
struct nav_texture_novelty *nav_texture_novelty_new(const struct nav_texture_novelty_numbers *);
void nav_texture_novelty_free(struct nav_texture_novelty *);

/* Takes a window's features[F]. Returns the log odds that the windows since the last reset, at most the last 16 or so,
 * are of a surface never trained: its log-likelihood ratio against the likeliest trained one, less the limit, in units
 * of `scale`. Allocates nothing. */
double nav_texture_novelty_weigh(struct nav_texture_novelty *, const double *features);

/* The next window is no continuation. */
void nav_texture_novelty_reset(struct nav_texture_novelty *);
/* cffi: end */

int nav_texture_novelty_features(const struct nav_texture_novelty *);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
