/*
 * Two bridges that tick together (the second's tick_in on the first's tick_out: docs/timing.md) as one of 56 lanes:
 * their frames in one row, tick by tick, for one ring. The first bridge's frame of a tick comes first, the second's
 * follows with WHISKER_FRAME_SECOND. Tick n of both is the same tick if the second was started before the first.
 *
 * A pair belongs to one thread at a time. No allocation.
 */
#ifndef WHISKER_PAIR_H
#define WHISKER_PAIR_H

#include <stdbool.h>
#include <stdint.h>

#include "whisker/frame.h"

#define WHISKER_PAIR_HELD 64 /* frames of one bridge that wait for the other's; at 2 kHz 32 ms */

struct whisker_pair_counts {
    uint64_t paired;   /* ticks of which both frames came */
    uint64_t alone[2]; /* frames of each bridge whose other never came */
    uint64_t apart;    /* of the pairs, those whose SYNC came more than a microframe (125 us) from each other, by the
                          host's start-of-frame packets: they are not the same tick */
};

/* Owned by the caller; but for counts its fields are the library's. */
struct whisker_pair {
    struct whisker_pair_counts counts;
    struct whisker_frame held[2][WHISKER_PAIR_HELD];
    unsigned first[2], count[2];
    bool ending;
};

#pragma GCC visibility push(default)
/* Begins two new streams. */
void whisker_pair_init(struct whisker_pair *pair);

/*
 * One more frame of a bridge (0: the first, 1: the second), in the order of its stream. Call whisker_pair_next until it
 * returns 0 before the next one. Returns 0, or ARGUMENT: there is no such bridge, or whisker_pair_next was not called.
 */
int whisker_pair_add(struct whisker_pair *pair, int bridge, const struct whisker_frame *frame);

/*
 * What is complete: 2 frames of a tick, 1 whose other is lost (a later one of that bridge has come, or HELD frames
 * wait), or 0. Their sequence is 2 tick, of the second bridge 2 tick + 1: a gap is a loss, as in any ring.
 */
int whisker_pair_next(struct whisker_pair *pair, struct whisker_frame frames[2]);

/* Both streams have ended: whisker_pair_next gives what still waits. */
void whisker_pair_end(struct whisker_pair *pair);
#pragma GCC visibility pop

#endif
