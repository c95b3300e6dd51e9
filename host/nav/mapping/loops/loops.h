/* Which loops are closed by a row, by all hypotheses of a mapper. */
#ifndef NAV_LOOPS_H
#define NAV_LOOPS_H

#include "sequence.h"

enum { NAV_LOOPS_MOST = 16 };

/* A mapper's hypotheses, the likeliest of them, and the row that they have just taken. */
struct nav_loops {
    struct nav_particle_map *map;
    int maps;
    const struct nav_particle_map *best;
    long row;
};

/* Those of the likeliest hypothesis go to `out`, in which there is room for NAV_LOOPS_MOST, where with the others' vote
 * the probability of another thing is below NAV_CLOSURE_FALSE. None is said twice. Returns how many there are. */
int nav_loops_close(const struct nav_loops *, struct nav_sequence *, struct nav_closure *out);

#endif
