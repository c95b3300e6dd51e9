#include "whisker_base_socket.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "daemon_log.h"

#define BACKLOG 512 /* those who wait are served in turn; who does not fit is not */
/* For so long, and so often, another whisker-base on the same socket is looked after: it may be about to vanish. */
#define VANISH_MS 200
#define VANISH_LOOKS 20
#define LOCK_ENDING ".lock"
#define LOCK_BYTES (sizeof((struct sockaddr_un *)0)->sun_path + sizeof LOCK_ENDING)

static bool socket_refuse(const char *path, const char *what, const char *remedy)
{
    daemon_log(LOG_ERROR, "%s: %s; %s", path, what, remedy);
    return false;
}

static void socket_name_lock(const struct base_socket *socket, char path[LOCK_BYTES])
{
    snprintf(path, LOCK_BYTES, "%s" LOCK_ENDING, socket->address.sun_path);
}

static bool socket_is_same(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

/* Takes the lock that is there, or makes one. Returns its descriptor, or -1 with errno: EWOULDBLOCK if its owner lives,
 * EEXIST if the file is something else. */
static int socket_try_lock(const char *path)
{
    struct stat held, named;
    const int lock = open(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0600);
    if (lock < 0 || fstat(lock, &held) != 0) {
        return -1;
    }
    int error = !S_ISREG(held.st_mode) || held.st_size > 0 ? EEXIST : flock(lock, LOCK_EX | LOCK_NB) ? errno : 0;
    if (error == 0 && (lstat(path, &named) != 0 || !socket_is_same(&held, &named))) {
        error = EWOULDBLOCK; /* its owner has just removed it */
    }
    if (error != 0) {
        close(lock);
        errno = error;
        return -1;
    }
    return lock;
}

static bool socket_take_lock(struct base_socket *socket)
{
    const struct timespec pause = {.tv_nsec = VANISH_MS * 1000000L / VANISH_LOOKS};
    char path[LOCK_BYTES];
    socket_name_lock(socket, path);
    for (int i = 0; (socket->lock = socket_try_lock(path)) < 0 && errno == EWOULDBLOCK && i < VANISH_LOOKS; i++) {
        nanosleep(&pause, NULL);
    }
    return socket->lock >= 0 ||
           (errno == EWOULDBLOCK
                ? socket_refuse(socket->address.sun_path, strerror(EADDRINUSE), "stop the whisker-base that has it")
                : socket_refuse(path, strerror(errno), "choose another --socket, in a folder that can be written"));
}

/* Whether this is the socket of a process that has ended. */
static bool socket_is_left(const struct sockaddr_un *address)
{
    struct stat there;
    const int probe = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const bool left = lstat(address->sun_path, &there) == 0 && S_ISSOCK(there.st_mode) &&
                      connect(probe, (const struct sockaddr *)address, sizeof *address) != 0 && errno == ECONNREFUSED;
    close(probe);
    return left;
}

static bool socket_bind(struct base_socket *base)
{
    const struct sockaddr *address = (const struct sockaddr *)&base->address;
    const char *path = base->address.sun_path;
    int failed = bind(base->listening, address, sizeof base->address);
    if (failed && errno == EADDRINUSE) {
        if (!socket_is_left(&base->address)) {
            return socket_refuse(path, "there is something else, or another program listens",
                                 "stop that, or choose a path where nothing is");
        }
        unlink(path);
        failed = bind(base->listening, address, sizeof base->address);
    }
    return !failed || socket_refuse(path, strerror(errno), "choose a path that can be written");
}

bool base_socket_open(struct base_socket *base, const char *path)
{
    *base = (struct base_socket){.listening = -1, .lock = -1, .address.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof base->address.sun_path) {
        daemon_log(LOG_ERROR, "%s: the name is too long; choose a path of less than %zu letters", path,
                   sizeof base->address.sun_path);
        return false;
    }
    strcpy(base->address.sun_path, path);
    if (!socket_take_lock(base)) {
        return false;
    }
    base->listening = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (base->listening >= 0 && socket_bind(base)) {
        if (lstat(path, &base->made) == 0 && listen(base->listening, BACKLOG) == 0) {
            return true;
        }
        socket_refuse(path, strerror(errno), "choose a path that can be written");
    }
    base_socket_close(base);
    return false;
}

static void socket_remove_own(const char *path, const struct stat *own)
{
    struct stat there;
    if (lstat(path, &there) == 0 && socket_is_same(&there, own)) {
        unlink(path);
    }
}

void base_socket_close(struct base_socket *base)
{
    char path[LOCK_BYTES];
    struct stat lock;
    if (base->listening >= 0) {
        close(base->listening);
    }
    socket_remove_own(base->address.sun_path, &base->made);
    socket_name_lock(base, path);
    if (fstat(base->lock, &lock) == 0) {
        socket_remove_own(path, &lock);
        close(base->lock);
    }
}
