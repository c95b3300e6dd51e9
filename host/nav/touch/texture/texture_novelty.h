/* Surfaces never trained: how far windows in a row lie from the nearest trained surface.
 *
 * A window's features are the mean of its surface, plus what stays for all windows of a row (speed, load, the whisker),
 * plus the noise of one window. Axes are turned and scaled so that the noise has variance 1
 * along each and rows spread independently. The distance is the mean square, over the axes, of how many standard
 * deviations the mean of the windows in a row lies off the surface's.
 */
#ifndef NAV_TEXTURE_NOVELTY_H
#define NAV_TEXTURE_NOVELTY_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_texture_novelty;

enum { NAV_TEXTURE_ROW = 16 }; /* windows that a mean rests on; older ones fade */

/* F: features, K: classes. All arrays are copied. */
struct nav_texture_novelty_numbers {
    int classes, features;
    const double *turn;  /* [F][F] row f: what feature f adds along each axis */
    const double *mean;  /* [K][F] turned */
    const double *row;   /* [F] variance of rows about the mean, >= 0 */
    const double *limit; /* [NAV_TEXTURE_ROW] of the distance of 1, 2, .. windows, > 0 */
};

/* NULL when a size or number is out of range or memory is short. */
struct nav_texture_novelty *nav_texture_novelty_new(const struct nav_texture_novelty_numbers *);
void nav_texture_novelty_free(struct nav_texture_novelty *);

/* Takes a window's features[F]. Returns the distance of the windows since the last reset, at most the last 16 or so,
 * over the limit of so many: above 1 they are of a surface never trained. Allocates nothing. */
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
