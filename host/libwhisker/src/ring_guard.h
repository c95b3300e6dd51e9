/*
 * Shared memory whose file another process makes shorter is gone: touching it raises SIGBUS. Over mappings named here
 * the process does not die: zeroed memory of its own takes the place of the whole mapping, and the ring's magic is no
 * longer there, by which its user knows. Any other SIGBUS goes to whom it went before.
 */
#ifndef WHISKER_RING_GUARD_H
#define WHISKER_RING_GUARD_H

#include <stdbool.h>
#include <stddef.h>

/* Guards `bytes` bytes from `base`, mapped with `protection`. False: no memory for it. */
bool ring_guard_add(void *base, size_t bytes, int protection);

/* Ends that; before the mapping goes. */
void ring_guard_remove(const void *base);

#endif
