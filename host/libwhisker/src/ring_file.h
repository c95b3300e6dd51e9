/* Files of shared memory: their names, their locks, and who may take a name. POSIX shared memory as Linux has it. */
#ifndef WHISKER_RING_FILE_H
#define WHISKER_RING_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/stat.h>

#include "ring_place.h"

/* Bytes of the file that are locked (open file description locks, which end with the process that holds them). */
enum ring_lock {
    RING_LOCK_WRITER = 0,  /* for writing: a writer lives */
    RING_LOCK_WAITING = 1, /* for reading: readers wait, so publications must wake them */
};

/* Opens an existing file for reading, without waiting and without following links, and says what it is. RING_MISSING,
 * RING_LAYOUT (no regular file), RING_ACCESS, SYSTEM. */
int ring_file_open(const char *path, int *fd, struct stat *file);

/* Makes a file without a name in this directory, `bytes` long and all allotted. MEMORY: there is no room. SYSTEM. */
int ring_file_make(const char *directory, size_t bytes, int *fd);

/* Takes the lock. False: another one has it. */
bool ring_file_lock(int fd, enum ring_lock lock);

/* Whether another one has the lock. */
bool ring_file_is_locked(int fd, enum ring_lock lock);

/* Whether the file still has this name. */
bool ring_file_is_named(int fd, const char *path);

/* Whether these are one file. */
bool ring_file_is_same(const struct stat *a, const struct stat *b);

/* The path of the lock that a process that changes what this path stands for must have. */
void ring_file_lock_path(const char *path, char lock_path[RING_PATH_BYTES]);

/* Gives the complete file its name, in place of a ring whose writer is dead. RING_BUSY (its writer lives), RING_LAYOUT
 * (something else has the name), RING_ACCESS, SYSTEM. */
int ring_file_name(int fd, const char *path);

/* Removes the name if it is this file's. */
void ring_file_unname(int fd, const char *path);

/* Removes the ring of this path if its writer is dead. RING_MISSING, RING_BUSY, RING_LAYOUT, RING_ACCESS, SYSTEM. */
int ring_file_remove_stale(const char *path);

#endif
