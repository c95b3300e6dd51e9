/* Files of shared memory: their names, their locks, and who may take a name. POSIX shared memory as Linux has it. */
#ifndef WHISKER_RING_FILE_H
#define WHISKER_RING_FILE_H

#include <stdbool.h>
#include <stddef.h>

#define RING_DIRECTORY "/dev/shm" /* where shm_open keeps its names */
#define RING_NAME_MAX 200
#define RING_PATH_BYTES 256

/* Bytes of the file that are locked (open file description locks, which end with whoever holds them). */
enum ring_lock {
    RING_LOCK_WRITER = 0,  /* for writing: a writer lives */
    RING_LOCK_WAITING = 1, /* for reading: readers wait, so publications must wake them */
};

/* The path of a ring's file, or RING_NAME. */
int ring_path(const char *name, char path[RING_PATH_BYTES]);

/* Opens an existing file for reading, without waiting and without following links. RING_MISSING, RING_LAYOUT (no
 * regular file), SYSTEM. */
int ring_file_open(const char *path, int *fd);

/* Makes a file without a name, `bytes` long and all allotted. MEMORY: there is no room. SYSTEM. */
int ring_file_make(size_t bytes, int *fd);

/* Takes the lock. False: another one has it. */
bool ring_file_lock(int fd, enum ring_lock lock);

/* Whether another one has the lock. */
bool ring_file_is_locked(int fd, enum ring_lock lock);

/* Whether the file still has this name. */
bool ring_file_is_named(int fd, const char *path);

/* Gives the complete file its name, in place of a ring whose writer is dead. RING_BUSY (its writer lives), RING_LAYOUT
 * (something else has the name), SYSTEM. */
int ring_file_name(int fd, const char *path);

/* Removes the name if it is this file's. */
void ring_file_unname(int fd, const char *path);

/* Removes the ring of this name if its writer is dead. RING_MISSING, RING_BUSY, RING_LAYOUT, SYSTEM. */
int ring_file_remove_stale(const char *path);

#endif
