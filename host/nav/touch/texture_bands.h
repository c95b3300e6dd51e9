/* Logarithms of the powers of a stretch of one channel: in bands of a third of an octave (fewer where the stretch
 * resolves less), of the whole, and of the steps from sample to sample. */
#ifndef NAV_TEXTURE_BANDS_H
#define NAV_TEXTURE_BANDS_H

#include <stddef.h>

struct nav_texture_bands;

/* Counts squared, far below any sensor's step: keeps a constant channel's logs finite. */
#define NAV_TEXTURE_TINY 1e-12

/* Stretches of `length` samples, at least NAV_TEXTURE_LENGTH_MIN. NULL without memory. */
struct nav_texture_bands *nav_texture_bands_new(int length);
void nav_texture_bands_free(struct nav_texture_bands *);

/* Numbers that a stretch is reduced to. */
int nav_texture_bands_count(const struct nav_texture_bands *);

/* x: [length] less their mean, `squares` the sum of their squares; floor (counts squared, > 0): power below which a
 * band says nothing. Returns the end of what it wrote to out. Allocates nothing. */
double *nav_texture_bands_work(struct nav_texture_bands *, const double *x, double squares, double floor, double *out);

/* to[n] = every stride-th number of `from` less their mean, which is returned; *squares: the sum of their squares. */
double nav_texture_centre(const double *from, size_t stride, int n, double *to, double *squares);

#endif
