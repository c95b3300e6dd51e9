/* What a window of vibration is reduced to: logarithms of band powers of each channel, and how channels move together.
 *
 * Of each channel: log of the power in bands of a third of an octave (fewer where the window resolves less) and log of
 * the power of the steps from sample to sample; then the mean and the standard deviation of the same logs over eight
 * stretches of two ninths of the window, each half over the next. The log of one long window's band errs much where the
 * band holds few bins, and one knock fills all bands; the mean over stretches errs less, and the deviation shows what
 * comes in bursts. Windows too short for stretches do without. Of each pair of channels: Fisher's z (atanh) of the
 * correlation. All is taken about the straight line that fits best, so neither an offset nor a drift
 * changes the powers; a gain (load, whisker stiffness) moves all powers of a channel alike, which a linear rule can
 * take out. Nothing depends on units of time: bands count cycles per window, so any sampling rate will do.
 *
 * Last, with `shape`, the waveform: convolution kernels of nine taps, three of 2 and six of -1, in all 84 orders
 * (Dempster et al. 2021, MiniRocket), spread over 1, 2, 4 ... samples. A number is the share of a channel's places
 * where one kernel's output is above a threshold. Kernels take the channels in turn, so the count does not grow with
 * them.
 */
#ifndef NAV_TEXTURE_FEATURES_H
#define NAV_TEXTURE_FEATURES_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_texture_features;

enum { NAV_TEXTURE_LENGTH_MIN = 4, NAV_TEXTURE_LENGTH_MAX = 4096, NAV_TEXTURE_CHANNELS_MAX = 64 };

/* Windows of `length` samples of `channels`; floor[channels] (counts squared, >= 0): power below which a band says
 * nothing, as quantisation's; shape: NULL, or thresholds [nav_texture_shape_count(length)]. Arrays are copied. NULL for
 * a size out of range, a number that is not finite, a floor below 0, or without memory.
 */
struct nav_texture_features *nav_texture_features_new(int channels, int length, const double *floor,
                                                      const double *shape);
void nav_texture_features_free(struct nav_texture_features *);

/* Numbers that a window is reduced to. */
int nav_texture_features_count(const struct nav_texture_features *);

/* Those of them that are shares of kernels; 0 where windows of so many samples are too short for one kernel. */
int nav_texture_shape_count(int length);

/* window: [length][channels], finite; out: nav_texture_features_count() finite numbers. Allocates nothing. */
void nav_texture_features_work(struct nav_texture_features *, const double *window, double *out);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
