/* Equation 1 over a sliding window, sample by sample: what enters is added and what leaves is taken off, so the cost
 * does not depend on the window. Sums are of whole numbers (2^-32 nat), hence exact: they never drift. */
#ifndef NAV_TEXTURE_SLIDE_H
#define NAV_TEXTURE_SLIDE_H

#include "texture.h"

/* cffi: begin */
struct nav_texture_slide;

enum { NAV_TEXTURE_SLIDE_MAX = 1 << 20 };

/* A window of the last `window` samples (1 .. NAV_TEXTURE_SLIDE_MAX) for each of `whiskers`, all with the model's
 * tables, which are copied: finish the model first. NULL for impossible sizes or without memory; nothing is allocated
 * later. */
struct nav_texture_slide *nav_texture_slide_new(const struct nav_texture *, int whiskers, int window);
void nav_texture_slide_free(struct nav_texture_slide *);

/* Takes samples[n][whiskers][axes], counts relative to each whisker's rest. A sample with a non-finite axis takes its
 * place in its whisker's window and is no evidence. */
void nav_texture_slide_push(struct nav_texture_slide *, const double *samples, long n);

/* Log-likelihoods [classes] of a whisker's window; returns the samples that are evidence in it. */
long nav_texture_slide_loglik(const struct nav_texture_slide *, int whisker, double *loglik);

/* Samples of a whisker that were left out since the start. */
long nav_texture_slide_bad(const struct nav_texture_slide *, int whisker);

void nav_texture_slide_reset(struct nav_texture_slide *);
/* cffi: end */

#endif
