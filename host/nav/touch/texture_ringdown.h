/* A whisker that leaves a rougher surface, or an edge, rings on at its own frequency for a tenth of a second or two:
 * louder than the floor under it, and just as loud, for a while, as a surface between the two. Floors get quieter by
 * chance; the ringing does so steadily, in every channel. */
#ifndef NAV_TEXTURE_RINGDOWN_H
#define NAV_TEXTURE_RINGDOWN_H

/* cffi: begin */
struct nav_texture_ringdown;

enum {
    NAV_TEXTURE_RINGDOWN_LEAST = 4,
    NAV_TEXTURE_RINGDOWN_MOST = 8,
    NAV_TEXTURE_RINGDOWN_LIMITS = NAV_TEXTURE_RINGDOWN_MOST - NAV_TEXTURE_RINGDOWN_LEAST + 1
};

/* Both arrays are copied. */
struct nav_texture_ringdown_numbers {
    int channels, length; /* samples of a block */
    const double *floor;  /* [channels] counts squared: power below which a channel says nothing */
    const double *limit;  /* [NAV_TEXTURE_RINGDOWN_LIMITS] nats per block, > 0: the fastest fall over 4, 5 .. 8 blocks
                             that  a floor makes */
};

/* NULL when a number is out of range or memory is short. */
struct nav_texture_ringdown *nav_texture_ringdown_new(const struct nav_texture_ringdown_numbers *);
void nav_texture_ringdown_free(struct nav_texture_ringdown *);

/* Takes a block [length][channels], finite, the next in a row. Allocates nothing. */
void nav_texture_ringdown_take(struct nav_texture_ringdown *, const double *block);

/* How fast the log of the power, its mean over the channels, falls over the last `blocks` (4 .. 8): minus the slope of
 * the line through it, nats per block; 0 when fewer are held. */
double nav_texture_ringdown_fall(const struct nav_texture_ringdown *, int blocks);

/* Whether the fall over the blocks held, 8 at most, is faster than its limit; never with fewer than 4. */
int nav_texture_ringdown_rings(const struct nav_texture_ringdown *);

/* The next block is no continuation. */
void nav_texture_ringdown_reset(struct nav_texture_ringdown *);
/* cffi: end */

int nav_texture_ringdown_length(const struct nav_texture_ringdown *);

#endif
