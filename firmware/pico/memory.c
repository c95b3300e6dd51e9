#include "memory.h"

#include <stdint.h>

void *memset(void *to, int value, size_t n)
{
    uint8_t *at = to;
    while (n-- > 0)
        *at++ = (uint8_t)value;
    return to;
}

void *memcpy(void *restrict to, const void *restrict from, size_t n)
{
    uint8_t *at = to;
    const uint8_t *source = from;
    if ((((uintptr_t)to | (uintptr_t)from) & 3u) == 0) /* records, packets */
        for (; n >= 4; n -= 4, at += 4, source += 4)
            *(uint32_t *)(void *)at = *(const uint32_t *)(const void *)source;
    while (n-- > 0)
        *at++ = *source++;
    return to;
}
