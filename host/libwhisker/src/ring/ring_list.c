#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "ring_file.h"
#include "ring_map.h"
#include "whisker/errors.h"
#include "whisker/ring.h"

/* The file that an error is about, and what is to be said of it. */
struct culprit {
    char path[RING_PATH_BYTES];
    char user[RING_USER_BYTES];
    uid_t owner;
};

static bool ring_explain_look_at(const char *path, struct culprit *culprit)
{
    struct stat file;
    if (lstat(path, &file) != 0) {
        return false;
    }
    snprintf(culprit->path, sizeof culprit->path, "%s", path);
    ring_owner_name(file.st_uid, culprit->user);
    culprit->owner = file.st_uid;
    return true;
}

/* The first file of the name: what readers meet, and writers too. */
static bool ring_explain_find_ring(const char *name, struct culprit *culprit)
{
    char path[RING_PATH_BYTES];
    for (enum ring_place place = 0; place < RING_PLACES; place++) {
        if (ring_path(name, place, path) == WHISKER_OK && ring_explain_look_at(path, culprit)) {
            return true;
        }
    }
    return false;
}

/* The lock of the name in the shared directory, if another user has made it: no writer of this user passes it. */
static bool ring_explain_find_foreign_lock(const char *name, struct culprit *culprit)
{
    char path[RING_PATH_BYTES], lock_path[RING_PATH_BYTES];
    if (ring_path(name, RING_PLACE_SHARED, path) != WHISKER_OK) {
        return false;
    }
    ring_file_lock_path(path, lock_path);
    return ring_explain_look_at(lock_path, culprit) && culprit->owner != geteuid();
}

/* A ring of another user that can be read and has no writer. */
static bool ring_explain_is_stale(const struct culprit *culprit)
{
    int fd;
    struct stat file;
    if (culprit->owner == geteuid() || ring_file_open(culprit->path, &fd, &file) != WHISKER_OK) {
        return false;
    }
    const bool locked = ring_file_is_locked(fd, RING_LOCK_WRITER);
    close(fd);
    return !locked;
}

static void ring_explain_say_access(const char *name, const struct culprit *ring, char *line, size_t room)
{
    struct culprit lock;
    if (ring_explain_find_foreign_lock(name, &lock)) {
        snprintf(line, room, "this ring's lock %s is user %s's; remove it: sudo rm %s; or choose another --ring",
                 lock.path, lock.user, lock.path);
    } else if (ring_explain_is_stale(ring)) {
        snprintf(line, room, "the ring %s is user %s's and stale: its writer died; remove it: sudo rm %s", ring->path,
                 ring->user, ring->path);
    } else {
        snprintf(line, room, "the ring %s is user %s's, who keeps it closed; %s", ring->path, ring->user,
                 whisker_error_remedy(WHISKER_ERROR_RING_ACCESS));
    }
}

void whisker_ring_explain(const char *name, int error, char *line, size_t room)
{
    struct culprit ring = {0};
    const bool is_there = ring_explain_find_ring(name, &ring);
    if (error == WHISKER_ERROR_RING_ACCESS && (is_there || ring_explain_find_foreign_lock(name, &ring))) {
        ring_explain_say_access(name, &ring, line, room);
    } else if (error == WHISKER_ERROR_RING_OWNER && is_there) {
        snprintf(line, room,
                 "the ring %s is user %s's, whom this reader is not set to trust; if it should, add --ring-owner %s; "
                 "else remove it: sudo rm %s",
                 ring.path, ring.user, ring.user, ring.path);
    } else if (is_there && (error == WHISKER_ERROR_RING_BUSY || error == WHISKER_ERROR_RING_LAYOUT ||
                            error == WHISKER_ERROR_WRITER_DEAD || error == WHISKER_ERROR_RING_WRITER)) {
        snprintf(line, room, "%s (%s, user %s's); %s", whisker_error_text(error), ring.path, ring.user,
                 whisker_error_remedy(error));
    } else {
        snprintf(line, room, "%s; %s", whisker_error_text(error), whisker_error_remedy(error));
    }
}

static_assert(WHISKER_RING_NAME_BYTES > RING_NAME_MAX && WHISKER_RING_PATH_BYTES == RING_PATH_BYTES, "a name fits");

/* Why no reader can attach; 0: nothing. */
static int ring_list_trouble(int fd, const struct stat *file)
{
    uint32_t capacity;
    if (!ring_owner_is_trusted(file->st_uid, WHISKER_RING_NO_OWNER)) {
        return WHISKER_ERROR_RING_OWNER;
    }
    return ring_file_is_locked(fd, RING_LOCK_WRITER) ? ring_map_check(fd, file, &capacity) : WHISKER_ERROR_WRITER_DEAD;
}

/* Describes the ring in this file; false: it is none. */
static bool ring_list_describe(int fd, const struct stat *file, struct whisker_ring_entry *entry)
{
    struct ring_header header;
    if (pread(fd, &header, sizeof header, 0) != sizeof header || header.magic != RING_MAGIC) {
        return false;
    }
    entry->bytes = (uint64_t)file->st_size;
    entry->owner = file->st_uid;
    entry->version = header.version;
    entry->error = ring_list_trouble(fd, file);
    if (header.version != RING_LAYOUT_VERSION) { /* where the rest lies is not known */
        return true;
    }
    entry->published = header.head;
    entry->generation = header.generation;
    entry->capacity = header.capacity;
    entry->writer_pid = header.writer_pid;
    return true;
}

static bool ring_list_describe_named(const char *name, enum ring_place place, struct whisker_ring_entry *entry)
{
    int fd;
    struct stat file;
    *entry = (struct whisker_ring_entry){0};
    if (ring_path(name, place, entry->path) != WHISKER_OK || ring_file_open(entry->path, &fd, &file) != WHISKER_OK) {
        return false;
    }
    strcpy(entry->name, name); /* ring_path has measured it */
    const bool is_ring = ring_list_describe(fd, &file, entry);
    close(fd);
    return is_ring;
}

/* Adds the rings of one directory to the `count` entries found before; there may be no such directory. */
static int list_place(enum ring_place place, struct whisker_ring_entry *entries, size_t room, int count)
{
    DIR *directory = opendir(ring_directories[place]);
    if (!directory) {
        return errno == ENOENT || errno == EACCES ? count : WHISKER_ERROR_SYSTEM;
    }
    struct whisker_ring_entry entry;
    for (const struct dirent *file; (file = readdir(directory));) {
        if (ring_list_describe_named(file->d_name, place, &entry)) {
            if ((size_t)count < room) {
                entries[count] = entry;
            }
            count++;
        }
    }
    closedir(directory);
    return count;
}

int whisker_ring_list(struct whisker_ring_entry *entries, size_t room)
{
    int count = 0;
    for (enum ring_place place = 0; place < RING_PLACES && count >= 0; place++) {
        count = list_place(place, entries, room, count);
    }
    return count;
}
