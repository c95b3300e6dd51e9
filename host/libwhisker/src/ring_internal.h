/* What the handles of ring.h hold. */
#ifndef WHISKER_RING_INTERNAL_H
#define WHISKER_RING_INTERNAL_H

#include "ring_map.h"
#include "whisker/ring.h"

struct whisker_ring {
    struct ring_map map;
    char path[RING_PATH_BYTES];
    uint64_t head; /* own copies of what the header publishes */
    uint64_t claim;
};

struct whisker_reader {
    struct ring_map map;
    char path[RING_PATH_BYTES];
    uint64_t generation;
    uint64_t position;
    uint64_t peeked; /* frames the last peek gave */
    uint64_t overruns;
    uint64_t frames_overrun;
    uint64_t frames_missing;
    uint32_t sequence; /* of the last frame left behind */
    bool has_sequence;
};

#endif
