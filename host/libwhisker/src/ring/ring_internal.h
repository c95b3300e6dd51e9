/* What the handles of ring.h hold. */
#ifndef WHISKER_RING_INTERNAL_H
#define WHISKER_RING_INTERNAL_H

#include <time.h>

#include "ring_map.h"
#include "whisker/ring.h"

struct whisker_ring {
    struct ring_map map;
    char path[RING_PATH_BYTES];
    uint64_t head; /* own copies of what the header publishes */
    uint64_t claim;
    struct timespec asked; /* when the kernel was last asked whether readers wait */
    bool readers_wait;     /* its answer */
};

struct whisker_reader {
    struct ring_map map;
    char name[RING_NAME_MAX + 1];
    uid_t owner; /* whose ring it is */
    uid_t named; /* whose rings are believed beside the usual ones, or WHISKER_RING_NO_OWNER */
    uint64_t generation;
    uint64_t position;
    uint64_t peeked; /* frames the last peek gave */
    uint64_t window; /* index of the first frame of the last window */
    uint64_t overruns;
    uint64_t frames_overrun;
    uint64_t frames_missing;
    int64_t waits_since_ms; /* when the writer was first informed that this reader waits; 0: not yet */
    uint32_t sequence;      /* of the last frame left behind */
    bool has_sequence;
    bool in_haste; /* the last wait had not to sleep */
};

#endif
