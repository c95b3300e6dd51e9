#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "ring_internal.h"
#include "ring_nodes.h"
#include "whisker/errors.h"

#define READABLE_BY_ALL (S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH)
/* "/proc/self/fd/" and a number */
#define PROC_PATH_BYTES 32

/* Beside the ring's name, with a dot so that no ring can have it. */
static void ring_nodes_path(const char *path, char nodes_path[RING_PATH_BYTES])
{
    const char *name = strrchr(path, '/') + 1;
    snprintf(nodes_path, RING_PATH_BYTES, "%.*s.%s.nodes", (int)(name - path), path, name);
}

static bool ring_nodes_write(int fd, const char *text)
{
    size_t left = strlen(text);
    while (left > 0) {
        const ssize_t wrote = write(fd, text, left);
        if (wrote < 0 && errno != EINTR) {
            return false;
        }
        text += wrote > 0 ? wrote : 0;
        left -= wrote > 0 ? (size_t)wrote : 0;
    }
    return true;
}

/* Gives the complete file its name: readers meet the old text, none, or the new one whole. */
static int ring_nodes_name(int fd, const char *path)
{
    char self[PROC_PATH_BYTES];
    snprintf(self, sizeof self, "/proc/self/fd/%d", fd);
    unlink(path);
    if (linkat(AT_FDCWD, self, AT_FDCWD, path, AT_SYMLINK_FOLLOW) == 0) {
        return WHISKER_OK;
    }
    return errno == EEXIST ? WHISKER_ERROR_RING_ACCESS : WHISKER_ERROR_SYSTEM;
}

int whisker_ring_set_nodes(struct whisker_ring *ring, const char *text)
{
    char path[RING_PATH_BYTES], directory[RING_PATH_BYTES];
    ring_nodes_path(ring->path, path);
    snprintf(directory, sizeof directory, "%.*s", (int)(strrchr(path, '/') - path), path);
    const int fd = open(directory, O_TMPFILE | O_WRONLY | O_CLOEXEC, READABLE_BY_ALL);
    if (fd < 0) {
        return WHISKER_ERROR_SYSTEM;
    }
    const int error = ring_nodes_write(fd, text) ? ring_nodes_name(fd, path) : WHISKER_ERROR_SYSTEM;
    close(fd);
    return error;
}

void ring_nodes_remove(const char *ring_path)
{
    char path[RING_PATH_BYTES];
    ring_nodes_path(ring_path, path);
    unlink(path);
}

static int ring_nodes_read(const char *path, uint32_t owner, char *text, size_t room, int64_t *written_ns)
{
    int fd;
    struct stat file;
    int error = ring_file_open(path, &fd, &file);
    if (error) {
        return error;
    }
    ssize_t got = 0;
    if (!ring_owner_is_trusted(file.st_uid, owner)) {
        error = WHISKER_ERROR_RING_OWNER;
    } else if ((got = pread(fd, text, room - 1, 0)) < 0) {
        error = WHISKER_ERROR_SYSTEM;
    } else {
        text[got] = '\0';
        *written_ns = (int64_t)file.st_ctim.tv_sec * 1000000000 + file.st_ctim.tv_nsec;
    }
    close(fd);
    return error;
}

int whisker_ring_nodes(const char *name, uint32_t owner, char *text, size_t room, int64_t *written_ns)
{
    int error = room > 0 ? WHISKER_ERROR_RING_MISSING : WHISKER_ERROR_ARGUMENT;
    for (enum ring_place place = 0; place < RING_PLACES && error == WHISKER_ERROR_RING_MISSING; place++) {
        char path[RING_PATH_BYTES], nodes_path[RING_PATH_BYTES];
        error = ring_path(name, place, path);
        if (!error) {
            ring_nodes_path(path, nodes_path);
            error = ring_nodes_read(nodes_path, owner, text, room, written_ns);
        }
    }
    return error;
}
