/* Floor texture from whisker vibration: stationary naive Bayes (CrunchBot paper, equation 1). */
#ifndef NAV_TEXTURE_H
#define NAV_TEXTURE_H

#include <stdbool.h>
#include <stddef.h>

/* cffi: begin */
/* Histograms of deflection, one per class and axis, in uniform bins. Samples are counts relative to the whisker's rest,
 * row-major [n][axes]. Values beyond the range count in the end bins; a sample with a non-finite axis is skipped. */
struct nav_texture;

/* low, high: range of each axis, counts. NULL when a size is below 1, a range is empty or memory is short. */
struct nav_texture *nav_texture_new(int classes, int axes, int bins, const double *low, const double *high);
void nav_texture_free(struct nav_texture *);

/* Adds training samples of one class (0 .. classes-1); returns how many were used, -1 for an unknown class. */
long nav_texture_add(struct nav_texture *, int class_index, const double *samples, size_t n);

/* Turns counts into log-likelihoods log P(x|T) with Laplace smoothing (pseudo > 0 added to every bin): natural log of
 * the probability of a bin. Call it after the last nav_texture_add. */
void nav_texture_finish(struct nav_texture *, double pseudo);

/* Equation 1: loglik[classes] = sum over samples and axes of log P(x_i|T_l). Returns the number of samples used; with
 * none used every entry is 0 (no evidence). */
size_t nav_texture_loglik(const struct nav_texture *, const double *samples, size_t n, double *loglik);

/* The log-likelihoods themselves, [class][axis][bin], for saving and loading a model. */
double *nav_texture_table(struct nav_texture *);
/* cffi: end */

int nav_texture_classes(const struct nav_texture *);
int nav_texture_axes(const struct nav_texture *);
int nav_texture_bins(const struct nav_texture *);

/* The bin of each axis; false, and nothing written, for a sample that is not finite. */
bool nav_texture_place(const struct nav_texture *, const double *sample, int *bin);

#endif
