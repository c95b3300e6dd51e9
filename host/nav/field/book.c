#include "book.h"

#include <stdlib.h>
#include <string.h>

static size_t book_hash(const uint8_t *key, size_t width)
{
    uint64_t h = 14695981039346656037u; /* FNV-1a */
    for (size_t i = 0; i < width; i++)
        h = (h ^ key[i]) * 1099511628211u;
    return (size_t)(h ^ (h >> 29));
}

/* Open addressing: where the key is or belongs. */
static size_t book_place(const struct nav_book *b, const uint8_t *key)
{
    size_t i = book_hash(key, b->width) & (b->slots - 1);
    while (b->slot[i] && memcmp(b->keys + (b->slot[i] - 1) * b->width, key, b->width) != 0)
        i = (i + 1) & (b->slots - 1);
    return i;
}

static int book_grow(struct nav_book *b)
{
    uint32_t room = b->room ? 2 * b->room : 1024;
    uint8_t *keys = realloc(b->keys, (size_t)room * b->width);
    uint32_t *slot = calloc((size_t)room * 2, sizeof *slot);
    if (keys)
        b->keys = keys;
    if (!keys || !slot) {
        free(slot);
        return -1;
    }
    free(b->slot);
    b->slot = slot;
    b->slots = (size_t)room * 2;
    b->room = room;
    for (uint32_t n = 0; n < b->count; n++)
        b->slot[book_place(b, b->keys + n * b->width)] = n + 1;
    return 0;
}

uint32_t nav_book_number(struct nav_book *b, const void *key)
{
    if (b->count == b->room && (b->room >= UINT32_MAX / 4 || book_grow(b)))
        return NAV_BOOK_FULL;
    size_t i = book_place(b, key);
    if (!b->slot[i]) {
        memcpy(b->keys + b->count * b->width, key, b->width);
        b->slot[i] = ++b->count;
    }
    return b->slot[i] - 1;
}

const void *nav_book_key(const struct nav_book *b, uint32_t number)
{
    return b->keys + number * b->width;
}

void nav_book_free(struct nav_book *b)
{
    free(b->slot);
    free(b->keys);
}
