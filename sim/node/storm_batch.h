/* One batch of a storm. */
#ifndef STORM_BATCH_H
#define STORM_BATCH_H

#include "storm.h"

/* Batch `seed`: the same counts each time. */
struct storm_counts storm_batch(uint64_t seed);

#endif
