/* A whisker that leaves a rougher surface, or an edge, rings on at its own frequency for a tenth of a second or two:
 * louder than the floor under it, and just as loud, for a while, as a surface between the two. Floors get quieter by
 * chance; the ringing does so steadily, in every channel. */
#ifndef NAV_TEXTURE_SETTLE_H
#define NAV_TEXTURE_SETTLE_H

/* cffi: begin */
struct nav_texture_settle;

enum {
    NAV_TEXTURE_SETTLE_LEAST = 4,
    NAV_TEXTURE_SETTLE_MOST = 8,
    NAV_TEXTURE_SETTLE_LIMITS = NAV_TEXTURE_SETTLE_MOST - NAV_TEXTURE_SETTLE_LEAST + 1
};

/* Both arrays are copied. */
struct nav_texture_settle_numbers {
    int channels, length; /* samples of a block */
    const double *floor;  /* [channels] counts squared: power below which a channel says nothing */
    const double *limit; /* [NAV_TEXTURE_SETTLE_LIMITS] nats per block, > 0: the fastest fall over 4, 5 .. 8 blocks that
                            a floor makes */
};

/* NULL when a number is out of range or memory is short. */
struct nav_texture_settle *nav_texture_settle_new(const struct nav_texture_settle_numbers *);
void nav_texture_settle_free(struct nav_texture_settle *);

/* Takes a block [length][channels], finite, the next in a row. Allocates nothing. */
void nav_texture_settle_take(struct nav_texture_settle *, const double *block);

/* How fast the log of the power, its mean over the channels, falls over the last `blocks` (4 .. 8): minus the slope of
 * the line through it, nats per block; 0 when fewer are held. */
double nav_texture_settle_fall(const struct nav_texture_settle *, int blocks);

/* Whether the fall over the blocks held, 8 at most, is faster than its limit; never with fewer than 4. */
int nav_texture_settle_rings(const struct nav_texture_settle *);

/* The next block is no continuation. */
void nav_texture_settle_reset(struct nav_texture_settle *);
/* cffi: end */

int nav_texture_settle_length(const struct nav_texture_settle *);

#endif
