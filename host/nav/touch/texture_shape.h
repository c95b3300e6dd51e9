/* The shape of a window's waveform: shares of the window in which it resembles each of many short patterns.
 *
 * Patterns are convolution kernels of nine taps, three of 2 and six of -1, in all 84 orders (Dempster et al. 2021,
 * MiniRocket), spread over 1, 2, 4 ... samples. A number is the share of a channel's places where one kernel's output
 * is above a threshold. Kernels take the channels in turn, so the count does not grow with them.
 */
#ifndef NAV_TEXTURE_SHAPE_H
#define NAV_TEXTURE_SHAPE_H

/* cffi: begin */
/* Numbers that windows of so many samples are reduced to; 0 where they are too short for one kernel. */
int nav_texture_shape_count(int length);
/* cffi: end */

struct nav_texture_shape;

/* threshold[nav_texture_shape_count(length)], finite, copied. NULL for a length without numbers, a threshold that is
 * not finite, or without memory. */
struct nav_texture_shape *nav_texture_shape_new(int channels, int length, const double *threshold);
void nav_texture_shape_free(struct nav_texture_shape *);

/* x: [channels][length] less each channel's mean; out: nav_texture_shape_count() shares. Allocates nothing. */
void nav_texture_shape_work(struct nav_texture_shape *, const double *x, double *out);

#endif
