/* A ring's shared memory: file, checks, and the double mapping. Used by both sides. */
#ifndef WHISKER_RING_MAP_H
#define WHISKER_RING_MAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ring_file.h"
#include "ring_layout.h"

struct ring_map {
    struct ring_header *header;
    struct whisker_frame *frames; /* 2 * capacity: frame i is at i and at i + capacity */
    size_t header_bytes;
    uint32_t capacity; /* checked when mapped; the copy in shared memory is not trusted again */
    int fd;
};

/* Bytes of the file of a ring of this capacity. */
size_t ring_file_bytes(uint32_t capacity);

/* Maps `capacity` frames of fd twice. Takes fd over: it is closed by ring_unmap, and on failure. */
int ring_map(int fd, uint32_t capacity, bool writable, struct ring_map *map);

/* Checks that the open file is a ring with all its memory, and reads its capacity. Returns 0, RING_LAYOUT,
 * RING_VERSION.
 */
int ring_map_check(int fd, const struct stat *file, uint32_t *capacity);

void ring_unmap(struct ring_map *map);

/* Whether the memory is still a ring: false once its file was made shorter (ring_map.c guards it). */
static inline bool ring_is_whole(const struct ring_map *map)
{
    return ring_load(&map->header->magic) == RING_MAGIC;
}

/* Which file is the ring of a name: looked for in all directories, without mapping any. */

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
