/* A ring's shared memory: name, file, lock, and the double mapping. Used by both sides. */
#ifndef WHISKER_RING_MAP_H
#define WHISKER_RING_MAP_H

#include <stdbool.h>

#include "ring_layout.h"

#define RING_PATH_BYTES 256

struct ring_map {
    struct ring_header *header;
    struct whisker_frame *frames; /* 2 * capacity: frame i is at i and at i + capacity */
    size_t header_bytes;
    uint32_t capacity; /* checked when mapped; the copy in shared memory is not trusted again */
    int fd;
};

/* The name with its leading slash, or RING_NAME. */
int ring_path(const char *name, char path[RING_PATH_BYTES]);

/* Maps `capacity` frames of fd twice. Takes fd over: it is closed by ring_unmap, and on failure. */
int ring_map(int fd, uint32_t capacity, bool writable, struct ring_map *map);

/* Opens and maps an existing ring for reading and checks its header. RING_MISSING also while it is being made. */
int ring_map_existing(const char *path, struct ring_map *map);

void ring_unmap(struct ring_map *map);

/* Makes this open file the writer's. False: another one is. */
bool ring_lock_writer(int fd);

/* Whether a writer lives, seen from a file that is not the writer's. */
bool ring_writer_lives(int fd);

/* Whether the file still has this name. */
bool ring_is_named(int fd, const char *path);

#endif
