/* Block by block, a fraction of a window each: whether the surface changed, and whether the whisker still rings. */
#ifndef NAV_TEXTURE_WATCH_H
#define NAV_TEXTURE_WATCH_H

#include <stdbool.h>

#include "texture_stream.h"

struct nav_texture_watch {
    int channels, blocked;
    const struct nav_texture_limits *limits; /* lent, like both below; each may be NULL */
    struct nav_texture_change *change;
    struct nav_texture_ringdown *ringdown;
    double *block; /* [a block's length][channels] samples since the last block */
};

/* False without memory; free it in any case. `limits` are lent. */
bool nav_texture_watch_make(struct nav_texture_watch *, const struct nav_texture_rules *,
                            const struct nav_texture_limits *limits);
void nav_texture_watch_free(struct nav_texture_watch *);
void nav_texture_watch_reset(struct nav_texture_watch *);

/* Takes a sample [channels]. Returns, if the block that it completes shows that the surface has changed, how many
 * samples lie behind the change; else 0. What an edge holds, or nobody can read, interrupts the row of blocks. */
int nav_texture_watch_take(struct nav_texture_watch *, const double *sample, bool held);

/* Whether n samples say nothing of a floor: more than a quarter of the records bad, or a channel stuck or railed. */
bool nav_texture_unreadable(const struct nav_texture_health *, int n);

#endif
