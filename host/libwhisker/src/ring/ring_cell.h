/*
 * A value of the writer's that changes now and then, and of which readers want the latest: two copies and a version.
 * The copy of the current version is never written, so a writer killed while it writes the other one does no harm.
 */
#ifndef WHISKER_RING_CELL_H
#define WHISKER_RING_CELL_H

#include <stddef.h>

#include "ring_atomic.h"

#define RING_CELL(type)                                                                                                \
    struct {                                                                                                           \
        ring_word version;                                                                                             \
        ring_word copy[2][sizeof(type) / 8];                                                                           \
    }

/* Publishes `bytes` bytes, a multiple of 8, of value. */
void ring_cell_set(ring_word *version, ring_word *copies, const void *value, size_t bytes);

/* Copies the latest value, all zeros before the first. 0, or TIMEOUT when it changes faster than it can be copied. */
int ring_cell_get(const ring_word *version, const ring_word *copies, void *value, size_t bytes);

#endif
