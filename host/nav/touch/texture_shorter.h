/* A window of one channel by its shorter stretches: the mean of each one's log powers, and how far they spread.
 *
 * The log of one long window's band errs much where the band holds few bins, and one knock fills all bands; a mean of
 * logs over stretches errs less, and hears what lasts. The spread tells what comes in bursts.
 */
#ifndef NAV_TEXTURE_SHORTER_H
#define NAV_TEXTURE_SHORTER_H

struct nav_texture_shorter;

/* Stretches of a `parts`-th of `length` samples, each half over the next: 2 parts - 1 of them, parts >= 2, a stretch at
 * least NAV_TEXTURE_LENGTH_MIN long. NULL without memory. */
struct nav_texture_shorter *nav_texture_shorter_new(int length, int parts);
void nav_texture_shorter_free(struct nav_texture_shorter *);

/* Numbers that a window is reduced to. */
int nav_texture_shorter_count(const struct nav_texture_shorter *);

/* x: [length]; floor (counts squared, > 0) as for the whole. Returns the end of what it wrote to out. Allocates
 * nothing. */
double *nav_texture_shorter_work(struct nav_texture_shorter *, const double *x, double floor, double *out);

#endif
