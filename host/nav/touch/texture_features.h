/* What a window of vibration is reduced to: logarithms of band powers of each channel, and how channels move together.
 *
 * Of each channel: log of the power in bands of a third of an octave (fewer where the window resolves less), log of the
 * whole power and log of the power of the steps from sample to sample; with `levels` also its mean, and with `shorter`
 * the mean and the spread of the same logs over shorter stretches of the window (texture_shorter.h). Of each pair of
 * channels: Fisher's z (atanh) of their correlation. Last, with `shape`, shares of patterns of the waveform
 * (texture_shape.h). Means apart, an offset changes nothing, and a gain (load, whisker
 * stiffness) moves all the powers of a channel alike, which a linear rule can take out. Nothing depends on units of
 * time: bands count cycles per window, so any sampling rate will do.
 */
#ifndef NAV_TEXTURE_FEATURES_H
#define NAV_TEXTURE_FEATURES_H

/* cffi: begin */
struct nav_texture_features;

enum { NAV_TEXTURE_LENGTH_MIN = 4, NAV_TEXTURE_LENGTH_MAX = 4096, NAV_TEXTURE_CHANNELS_MAX = 64 };

/* Windows of `length` samples of `channels`; shorter: 0, or how many stretches lie end to end in a window, at least 2,
 * each at least NAV_TEXTURE_LENGTH_MIN long; floor[channels] (counts squared, >= 0): power below which a band says
 * nothing, as quantisation's; shape: NULL, or thresholds [nav_texture_shape_count(length)]. NULL for a size out of
 * range, a floor that is negative or not finite, or without memory.
 */
struct nav_texture_features *nav_texture_features_new(int channels, int length, int levels, int shorter,
                                                      const double *floor, const double *shape);
void nav_texture_features_free(struct nav_texture_features *);

/* Numbers that a window is reduced to. */
int nav_texture_features_count(const struct nav_texture_features *);

/* window: [length][channels], finite; out: nav_texture_features_count() finite numbers. Allocates nothing. */
void nav_texture_features_work(struct nav_texture_features *, const double *window, double *out);
/* cffi: end */

#endif
