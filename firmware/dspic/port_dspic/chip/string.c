/* The functions that the compiler calls by itself; no library is linked. */
#include <string.h>

void *memcpy(void *to, const void *from, size_t n)
{
    unsigned char *at = to;
    const unsigned char *source = from;
    while (n-- > 0)
        *at++ = *source++;
    return to;
}

void *memset(void *to, int value, size_t n)
{
    unsigned char *at = to;
    while (n-- > 0)
        *at++ = (unsigned char)value;
    return to;
}

int memcmp(const void *one, const void *other, size_t n)
{
    const unsigned char *a = one, *b = other;
    for (; n > 0; n--, a++, b++) {
        if (*a != *b)
            return *a < *b ? -1 : 1;
    }
    return 0;
}
