#include "ring_find.h"

#include <unistd.h>

#include "ring_map.h"
#include "whisker/errors.h"

/* What is wrong with this open file as a ring to be read; 0: nothing. Its owner comes first: what the file of another
 * user holds is not looked at. */
static int ring_find_check_found(struct ring_found *found, uid_t named)
{
    if (!ring_owner_is_trusted(found->file.st_uid, named)) {
        return WHISKER_ERROR_RING_OWNER;
    }
    const int error = ring_map_check(found->fd, &found->file, &found->capacity);
    return !error && !ring_file_is_locked(found->fd, RING_LOCK_WRITER) ? WHISKER_ERROR_WRITER_DEAD : error;
}

static int find_at(const char *path, uid_t named, struct ring_found *found)
{
    int error = ring_file_open(path, &found->fd, &found->file);
    if (error) {
        return error;
    }
    error = ring_find_check_found(found, named);
    if (error) {
        close(found->fd);
    }
    return error;
}

int ring_find(const char *name, uid_t named, struct ring_found *found)
{
    char path[RING_PATH_BYTES];
    int first = WHISKER_ERROR_RING_MISSING;
    for (enum ring_place place = 0; place < RING_PLACES; place++) {
        int error = ring_path(name, place, path);
        error = error ? error : find_at(path, named, found);
        if (!error) {
            return WHISKER_OK;
        }
        first = first == WHISKER_ERROR_RING_MISSING ? error : first;
    }
    return first;
}

bool ring_lives(const char *path)
{
    int fd;
    struct stat file;
    if (ring_file_open(path, &fd, &file) != WHISKER_OK) {
        return false;
    }
    const bool lives = ring_file_is_locked(fd, RING_LOCK_WRITER);
    close(fd);
    return lives;
}
