/* Which file is the ring of a name: looked for in all directories, without mapping any. */
#ifndef WHISKER_RING_FIND_H
#define WHISKER_RING_FIND_H

#include <stdint.h>

#include "ring_file.h"

/* A ring that was found: its file, open and checked. */
struct ring_found {
    int fd;
    uint32_t capacity;
    struct stat file;
};

/* Finds the ring of this name that a reader is to read: the first whose owner is believed and whose writer lives.
 * Returns 0, or what is wrong with the first file of the name: RING_NAME, RING_MISSING, RING_OWNER, RING_ACCESS,
 * RING_LAYOUT, RING_VERSION, WRITER_DEAD, SYSTEM. */
int ring_find(const char *name, uid_t named, struct ring_found *found);

/* Whether a ring of this path lives, with any owner. */
bool ring_lives(const char *path);

#endif
