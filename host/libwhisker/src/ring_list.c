#include <dirent.h>
#include <errno.h>
#include <string.h>
#include <unistd.h>

#include "ring_map.h"
#include "whisker/errors.h"
#include "whisker/ring.h"

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

int whisker_ring_remove_stale(const char *name)
{
    char path[RING_PATH_BYTES];
    const int error = ring_path(name, RING_PLACE_SHARED, path);
    return error ? error : ring_file_remove_stale(path);
}
