/* Counts what a test's program allocates, libraries linked into it included, and lets one allocation fail. For one file
 * of a program that links whisker_count_allocations: then the linker leads malloc, calloc, realloc and free through
 * here. */
#pragma once

#include <stdbool.h>
#include <stdlib.h>

static long allocations;       /* since the start, or since the test set it to 0 */
static long blocks;            /* allocated less those freed, likewise */
static long failed_allocation; /* the one that gets no memory, counted by `allocations`; 0: none */

/* The names that ld's --wrap gives. */
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *old, size_t size);
void __real_free(void *old);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *old, size_t size);
void __wrap_free(void *old);

/* Nothing is what one gets for asking for nothing: the standard allows it, and other libraries do so. */
static inline bool allocation_fails(size_t size)
{
    return ++allocations == failed_allocation || size == 0;
}

static inline void *count_block(void *made)
{
    blocks += made != NULL;
    return made;
}

void *__wrap_malloc(size_t size)
{
    return allocation_fails(size) ? NULL : count_block(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size)
{
    return allocation_fails(count * size) ? NULL : count_block(__real_calloc(count, size));
}

void *__wrap_realloc(void *old, size_t size)
{
    if (allocation_fails(size))
        return NULL;
    return old ? __real_realloc(old, size) : count_block(__real_realloc(old, size));
}

void __wrap_free(void *old)
{
    blocks -= old != NULL;
    __real_free(old);
}
