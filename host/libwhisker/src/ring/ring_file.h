/* Files of shared memory: their names, their locks, and who may take a name. POSIX shared memory as Linux has it. */
#ifndef WHISKER_RING_FILE_H
#define WHISKER_RING_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/stat.h>
#include <sys/types.h>

/* Where rings lie, and whose rings a reader believes. */

#define RING_NAME_MAX 200
#define RING_PATH_BYTES 512
#define RING_USER_BYTES 64

/* In the order in which readers look. */
enum ring_place {
    RING_PLACE_SERVICE, /* only the service's user can write there */
    RING_PLACE_SHARED,  /* everybody can: where shm_open keeps its names */
    RING_PLACES
};

/* The directories, and the service's user. Constant, but for tests, which put their own before the first use. */
extern const char *ring_directories[RING_PLACES];
extern const char *ring_service_user;

/* The path of a ring's file, or RING_NAME. */
int ring_path(const char *name, enum ring_place place, char path[RING_PATH_BYTES]);

/* Whether a ring of this user is believed: root's, the caller's own, the service's, and that of the user `named`. */
bool ring_owner_is_trusted(uid_t owner, uid_t named);

/* The user's name; its number where it has none. */
void ring_owner_name(uid_t owner, char name[RING_USER_BYTES]);

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

#endif
