#include <dirent.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "ring_map.h"
#include "whisker/errors.h"
#include "whisker/ring.h"

static_assert(WHISKER_RING_NAME_BYTES > RING_NAME_MAX, "a name fits");

/* Describes the ring in this file; false: it is none. */
static bool describe(int fd, struct whisker_ring_entry *entry)
{
    struct stat file;
    struct ring_header header;
    if (fstat(fd, &file) != 0 || pread(fd, &header, sizeof header, 0) != sizeof header || header.magic != RING_MAGIC) {
        return false;
    }
    entry->bytes = (uint64_t)file.st_size;
    entry->owner = file.st_uid;
    entry->version = header.version;
    entry->error = ring_file_is_locked(fd, RING_LOCK_WRITER) ? WHISKER_OK : WHISKER_ERROR_WRITER_DEAD;
    if (header.version != RING_LAYOUT_VERSION) { /* where the rest lies is not known */
        entry->error = entry->error ? entry->error : WHISKER_ERROR_RING_VERSION;
        return true;
    }
    entry->published = header.head;
    entry->generation = header.generation;
    entry->capacity = header.capacity;
    entry->writer_pid = header.writer_pid;
    return true;
}

static bool describe_named(const char *name, struct whisker_ring_entry *entry)
{
    char path[RING_PATH_BYTES];
    int fd;
    *entry = (struct whisker_ring_entry){0};
    if (ring_path(name, path) != WHISKER_OK || ring_file_open(path, &fd) != WHISKER_OK) {
        return false;
    }
    strcpy(entry->name, name); /* ring_path has measured it */
    const bool is_ring = describe(fd, entry);
    close(fd);
    return is_ring;
}

int whisker_ring_list(struct whisker_ring_entry *entries, size_t room)
{
    DIR *directory = opendir(RING_DIRECTORY);
    if (!directory) {
        return WHISKER_ERROR_SYSTEM;
    }
    struct whisker_ring_entry entry;
    int count = 0;
    for (const struct dirent *file; (file = readdir(directory));) {
        if (describe_named(file->d_name, &entry)) {
            if ((size_t)count < room) {
                entries[count] = entry;
            }
            count++;
        }
    }
    closedir(directory);
    return count;
}

int whisker_ring_remove_stale(const char *name)
{
    char path[RING_PATH_BYTES];
    const int error = ring_path(name, path);
    return error ? error : ring_file_remove_stale(path);
}
