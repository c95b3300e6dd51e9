#include <stdio.h>
#include <unistd.h>

#include "ring_file.h"
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
