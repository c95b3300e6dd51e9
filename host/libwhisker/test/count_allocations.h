/* Counts what a test's program allocates, libraries linked into it included. For one file of a program that links
 * whisker_count_allocations: then the linker leads malloc, calloc and realloc through here. */
#pragma once

#include <stdlib.h>

static long allocations; /* since the start, or since the test set it to 0 */

/* The names that ld's --wrap gives. */
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *old, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *old, size_t size);

void *__wrap_malloc(size_t size)
{
    allocations++;
    return __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size)
{
    allocations++;
    return __real_calloc(count, size);
}

void *__wrap_realloc(void *old, size_t size)
{
    allocations++;
    return __real_realloc(old, size);
}
