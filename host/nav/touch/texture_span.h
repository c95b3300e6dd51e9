/* Judges a stretch of any length by the classifier that fits it best. */
#ifndef NAV_TEXTURE_SPAN_H
#define NAV_TEXTURE_SPAN_H

#include "texture_stream.h"

struct nav_texture_span;

/* The rules' classifiers are lent. NULL without memory. */
struct nav_texture_span *nav_texture_span_new(const struct nav_texture_rules *);
void nav_texture_span_free(struct nav_texture_span *);

/* window: [n][channels], finite. The longest classifier that fits covers it in evenly spaced, overlapping windows,
 * whose log-likelihoods are averaged and grow with the number of whole lengths. Returns the classifier, or -1
 * (log-likelihoods 0) when the stretch is shorter than every classifier. */
int nav_texture_span_judge(struct nav_texture_span *, const double *window, int n, double *loglik);

#endif
