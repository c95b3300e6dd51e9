/* The classifier of a texture model for windows of one length.
 *
 * Features (texture_features.h), standardised; beside them `hidden` random projections cut at zero, which let a linear
 * rule bend (random features, Rahimi and Recht 2008; a seed stands for the projections in model files); then a linear
 * discriminant, whose scores are log-likelihoods up to a constant, tempered to what held-out recordings bear out.
 */
#ifndef NAV_TEXTURE_CLASSIFIER_H
#define NAV_TEXTURE_CLASSIFIER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_texture_classifier;

enum { NAV_TEXTURE_CLASSES_MAX = 256, NAV_TEXTURE_HIDDEN_MAX = 4096 };

/* A classifier's numbers. F: features, H: hidden, K: classes. All arrays are copied. */
struct nav_texture_classifier_numbers {
    int classes, channels, length, levels, hidden;
    int shorter;                  /* as in texture_features.h */
    uint64_t seed;                /* of the projections */
    double temper;                /* >= 0; scores are multiplied by it */
    const double *floor;          /* [channels] counts squared */
    const double *shape;          /* NULL, or thresholds as in texture_features.h */
    const double *centre, *scale; /* [F] feature -> (feature - centre) * scale */
    const double *weight, *bias;  /* [F + H][K], [K] */
};

/* NULL when a size is out of range, a number is not finite, or memory is short. */
struct nav_texture_classifier *nav_texture_classifier_new(const struct nav_texture_classifier_numbers *);
void nav_texture_classifier_free(struct nav_texture_classifier *);

/* Standardised features and projections of a window: out[F + H]; what a trainer fits its weights to. */
void nav_texture_classifier_expand(struct nav_texture_classifier *, const double *window, double *out);

/* window: [length][channels], finite and within +-1e9. loglik[K]: tempered, the largest is 0. Allocates nothing. */
void nav_texture_classifier_judge(struct nav_texture_classifier *, const double *window, double *loglik);
/* cffi: end */

/* Standardised features [nav_texture_classifier_count()] of the last window judged. */
const double *nav_texture_classifier_features(const struct nav_texture_classifier *);

int nav_texture_classifier_count(const struct nav_texture_classifier *); /* of features */
int nav_texture_classifier_length(const struct nav_texture_classifier *);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
