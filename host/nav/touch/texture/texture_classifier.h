/* The classifier of a texture model for windows of one length: a linear discriminant over features
 * (texture_features.h). Its scores are log-likelihoods up to a constant, with the temperature that held-out recordings
 * bear out already in the weights.
 */
#ifndef NAV_TEXTURE_CLASSIFIER_H
#define NAV_TEXTURE_CLASSIFIER_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_texture_classifier;

enum { NAV_TEXTURE_CLASSES_MAX = 256 };

/* A classifier's numbers. F: features, K: classes. All arrays are copied. */
struct nav_texture_classifier_numbers {
    int classes, channels, length;
    double behind;       /* >= 0: factor of the evidence of windows behind the first of a row, which err alike */
    const double *floor; /* [channels] counts squared */
    const double *shape; /* NULL, or thresholds as in texture_features.h */
    const double *weight, *bias; /* [F][K], [K] */
};

/* NULL when a size is out of range, a number is not finite, or memory is short. */
struct nav_texture_classifier *nav_texture_classifier_new(const struct nav_texture_classifier_numbers *);
void nav_texture_classifier_free(struct nav_texture_classifier *);

/* window: [length][channels], finite and within +-1e9. loglik[K]: the largest is 0. Allocates nothing. */
void nav_texture_classifier_judge(struct nav_texture_classifier *, const double *window, double *loglik);
/* cffi: end */

/* Features [nav_texture_classifier_count()] of the last window judged. */
const double *nav_texture_classifier_features(const struct nav_texture_classifier *);

int nav_texture_classifier_count(const struct nav_texture_classifier *); /* of features */
int nav_texture_classifier_length(const struct nav_texture_classifier *);
double nav_texture_classifier_behind(const struct nav_texture_classifier *);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
