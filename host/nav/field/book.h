/* Numbers for byte strings of one width: the same string, the same number, from 0 upwards. For building tables. */
#ifndef NAV_BOOK_H
#define NAV_BOOK_H

#include <stddef.h>
#include <stdint.h>

struct nav_book {
    uint32_t *slot; /* number + 1; 0: empty */
    size_t slots;   /* power of two */
    uint8_t *keys;  /* [count][width] */
    uint32_t count, room;
    size_t width; /* bytes, above 0 */
};

#define NAV_BOOK_FULL UINT32_MAX

/* Number of a key, new or known; NAV_BOOK_FULL: no memory. */
uint32_t nav_book_number(struct nav_book *, const void *key);

const void *nav_book_key(const struct nav_book *, uint32_t number);

void nav_book_free(struct nav_book *);

#endif
