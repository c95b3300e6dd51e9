#include "ring_cell.h"

#include <string.h>

#include "whisker/errors.h"

/* An honest writer changes a value a few times a second; more tries than this only help a mad one to hold readers up.
 */
#define TRIES 1000

void ring_cell_set(ring_word *version, ring_word *copies, const void *value, size_t bytes)
{
    const size_t words = bytes / 8;
    const uint64_t next = ring_load(version) + 1;
    ring_word *copy = copies + next % 2 * words;
    ring_fence_before_writing(); /* who sees a word of this copy also sees that the version before is the latest */
    for (size_t i = 0; i < words; i++) {
        uint64_t word;
        memcpy(&word, (const char *)value + 8 * i, 8);
        ring_store(&copy[i], word);
    }
    ring_store_release(version, next);
}

int ring_cell_get(const ring_word *version, const ring_word *copies, void *value, size_t bytes)
{
    const size_t words = bytes / 8;
    for (int i = 0; i < TRIES; i++) {
        const uint64_t seen = ring_load_acquire(version);
        const ring_word *copy = copies + seen % 2 * words;
        for (size_t w = 0; w < words; w++) {
            const uint64_t word = ring_load(&copy[w]);
            memcpy((char *)value + 8 * w, &word, 8);
        }
        ring_fence_after_reading();
        if (ring_load(version) == seen) {
            return WHISKER_OK;
        }
    }
    return WHISKER_ERROR_TIMEOUT;
}
