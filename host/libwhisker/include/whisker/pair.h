/*
 * Two bridges that tick together (the second's tick_in on the first's tick_out: docs/timing.md) as one of 56 lanes:
 * their frames in one row, tick by tick, for one ring. The first bridge's frame of a tick comes first, the second's
 * follows with WHISKER_FRAME_SECOND, with the first's tick and time.
 *
 * Each bridge counts ticks from its own start. Which tick of one is which of the other follows from the host's
 * start-of-frame number in each frame (usb_time): at the start, when one bridge was started again, and when one has
 * missed an edge. Without it (no start-of-frame packet, or two host controllers) tick n of both is taken as the same,
 * which holds if the second was started before the first.
 *
 * A pair belongs to one thread at a time. No allocation.
 */
#ifndef WHISKER_PAIR_H
#define WHISKER_PAIR_H

#include <stdbool.h>
#include <stdint.h>

#include "whisker/frame.h"

/* Frames of one bridge that wait for the other's: twice what whisker_device_start queues, for a process that stood
 * still gets all that is queued of one bridge, and what came meanwhile, before the first of the other. */
#define WHISKER_PAIR_HELD 512
/* Cycles: with a shorter tick period the start-of-frame number, of 125 us, does not tell ticks apart. */
#define WHISKER_PAIR_PERIOD_MIN 22500

struct whisker_pair_counts {
    uint64_t paired;    /* ticks of which both frames came */
    uint64_t alone[2];  /* frames of each bridge whose other never came */
    uint64_t apart;     /* pairs whose SYNC came more than a microframe (125 us) from each other: not the same tick */
    uint64_t realigned; /* times another tick of the second was found to be the first's */
};

/* Owned by the caller; but for counts its fields are the library's. */
struct whisker_pair {
    struct whisker_pair_counts counts;
    struct whisker_frame held[2][WHISKER_PAIR_HELD];
    unsigned first[2], count[2];
    uint32_t tick_period;
    int64_t offset; /* ticks from the second's number to the first's */
    bool running[2];
    bool silent[2]; /* it runs, but sends nothing */
    bool searching; /* for the offset */
    bool blind;     /* no offset agrees with the start-of-frame numbers */
};

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)
/* Begins two new streams; both run. tick_period: cycles, as set on both bridges. */
void whisker_pair_init(struct whisker_pair *pair, uint32_t tick_period);

/*
 * A bridge (0: the first, 1: the second) was started again, or has gone or ended. Nobody waits for the frames of one
 * that does not run; after false, and before true, whisker_pair_next gives all that is held.
 */
void whisker_pair_run(struct whisker_pair *pair, int bridge, bool running);

/*
 * One more frame of a bridge, in the order of its stream. Call whisker_pair_next until it returns 0 before the next
 * one. Returns 0, or ARGUMENT: there is no such bridge, or whisker_pair_next was not called.
 */
int whisker_pair_add(struct whisker_pair *pair, int bridge, const struct whisker_frame *frame);

/*
 * What is complete: 2 frames of a tick, 1 whose other is lost (a later one of that bridge has come, it does not run, or
 * it has sent nothing while HELD frames waited), or 0. Their sequence is 2 tick, of the second bridge 2 tick + 1: a gap
 * is a loss, as in any ring.
 */
int whisker_pair_next(struct whisker_pair *pair, struct whisker_frame frames[2]);
#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
