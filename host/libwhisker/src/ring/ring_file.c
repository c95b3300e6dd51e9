#include "ring_file.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <pwd.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "ring_layout.h"
#include "whisker/errors.h"
#include "whisker/ring.h"

/* What getpwnam_r wants for one user; a longer entry counts as none. */
#define USER_ENTRY_BYTES 4096

const char *ring_directories[RING_PLACES] = {WHISKER_RING_SERVICE_DIRECTORY, WHISKER_RING_DIRECTORY};
const char *ring_service_user = WHISKER_RING_SERVICE_USER;

static pthread_once_t service_once = PTHREAD_ONCE_INIT;
static uid_t service_owner = WHISKER_RING_NO_OWNER;

int ring_path(const char *name, enum ring_place place, char path[RING_PATH_BYTES])
{
    const size_t length = name ? strlen(name) : 0;
    if (length == 0 || length > RING_NAME_MAX || strchr(name, '/') || name[0] == '.') {
        return WHISKER_ERROR_RING_NAME;
    }
    const int written = snprintf(path, RING_PATH_BYTES, "%s/%s", ring_directories[place], name);
    return written < RING_PATH_BYTES ? WHISKER_OK : WHISKER_ERROR_RING_NAME;
}

static void ring_place_look_up_service(void)
{
    char text[USER_ENTRY_BYTES];
    struct passwd entry, *found = NULL;
    if (getpwnam_r(ring_service_user, &entry, text, sizeof text, &found) == 0 && found) {
        service_owner = found->pw_uid;
    }
}

bool ring_owner_is_trusted(uid_t owner, uid_t named)
{
    pthread_once(&service_once, ring_place_look_up_service);
    const bool is_service = service_owner != WHISKER_RING_NO_OWNER && owner == service_owner;
    const bool is_named = named != WHISKER_RING_NO_OWNER && owner == named;
    return owner == 0 || owner == geteuid() || is_service || is_named;
}

void ring_owner_name(uid_t owner, char name[RING_USER_BYTES])
{
    char text[USER_ENTRY_BYTES];
    struct passwd entry, *found = NULL;
    if (getpwuid_r(owner, &entry, text, sizeof text, &found) == 0 && found) {
        snprintf(name, RING_USER_BYTES, "%s", found->pw_name);
    } else {
        snprintf(name, RING_USER_BYTES, "%lu", (unsigned long)owner);
    }
}

#define READABLE_BY_ALL (S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH)
/* The process that has a name's lock needs microseconds; after this many milliseconds it is stopped, not slow. */
#define NAMING_TRIES_MS 2000

/* Why a file of the shared directory cannot be had, by errno. */
static int ring_file_refusal(void)
{
    return errno == EACCES || errno == EPERM ? WHISKER_ERROR_RING_ACCESS : WHISKER_ERROR_SYSTEM;
}

int ring_file_open(const char *path, int *fd, struct stat *file)
{
    *fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (*fd < 0) {
        return errno == ENOENT  ? WHISKER_ERROR_RING_MISSING
               : errno == ELOOP ? WHISKER_ERROR_RING_LAYOUT
                                : ring_file_refusal();
    }
    if (fstat(*fd, file) != 0 || !S_ISREG(file->st_mode)) {
        close(*fd);
        return WHISKER_ERROR_RING_LAYOUT;
    }
    return WHISKER_OK;
}

/* Memory is allotted here: a full directory shall fail now and not kill the writer at its first frame. */
int ring_file_make(const char *directory, size_t bytes, int *fd)
{
    *fd = open(directory, O_TMPFILE | O_RDWR | O_CLOEXEC, READABLE_BY_ALL);
    if (*fd < 0) {
        const bool is_shut = errno == EROFS || errno == ENOENT || errno == EACCES || errno == EOPNOTSUPP;
        return is_shut ? WHISKER_ERROR_RING_SHARED : WHISKER_ERROR_SYSTEM;
    }
    if (posix_fallocate(*fd, 0, (off_t)bytes) != 0) {
        close(*fd);
        return WHISKER_ERROR_MEMORY;
    }
    return WHISKER_OK;
}

static bool ring_file_lock_byte(int fd, short type, enum ring_lock byte)
{
    struct flock lock = {.l_type = type, .l_whence = SEEK_SET, .l_start = byte, .l_len = 1};
    return fcntl(fd, F_OFD_SETLK, &lock) == 0;
}

bool ring_file_lock(int fd, enum ring_lock lock)
{
    return ring_file_lock_byte(fd, lock == RING_LOCK_WRITER ? F_WRLCK : F_RDLCK, lock);
}

/* Asks for what conflicts with the lock and with nothing else: a reader that locks byte 0 is no writer. */
bool ring_file_is_locked(int fd, enum ring_lock lock)
{
    const short conflicting = lock == RING_LOCK_WRITER ? F_RDLCK : F_WRLCK;
    struct flock found = {.l_type = conflicting, .l_whence = SEEK_SET, .l_start = lock, .l_len = 1};
    return fcntl(fd, F_OFD_GETLK, &found) == 0 && found.l_type != F_UNLCK;
}

bool ring_file_is_same(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

bool ring_file_is_named(int fd, const char *path)
{
    struct stat mine, named;
    return fstat(fd, &mine) == 0 && lstat(path, &named) == 0 && ring_file_is_same(&mine, &named);
}

/* Opens the lock of a name, a file that only its owner can lock: any reader could hold a lock of the ring's. */
static int ring_file_open_naming_lock(const char *lock_path)
{
    for (;;) { /* not O_CREAT alone: the kernel may forbid it on another user's file in a sticky directory */
        int fd = open(lock_path, O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
        if (fd < 0 && errno == ENOENT) {
            fd = open(lock_path, O_RDWR | O_CLOEXEC | O_CREAT | O_EXCL, S_IRUSR | S_IWUSR);
        }
        if (fd >= 0 || (errno != EEXIST && errno != ENOENT)) {
            return fd;
        }
    }
}

/* Beside the ring's name, with a dot so that no ring can have it. */
void ring_file_lock_path(const char *path, char lock_path[RING_PATH_BYTES])
{
    const char *name = strrchr(path, '/') + 1;
    snprintf(lock_path, RING_PATH_BYTES, "%.*s.%s.lock", (int)(name - path), path, name);
}

/* Only one process at a time changes what a name stands for. */
static int ring_file_begin_naming(const char *path, int *lock)
{
    char lock_path[RING_PATH_BYTES];
    ring_file_lock_path(path, lock_path);
    for (int tries = 0; tries < NAMING_TRIES_MS; tries++) {
        *lock = ring_file_open_naming_lock(lock_path);
        if (*lock < 0) {
            return ring_file_refusal();
        }
        if (ring_file_lock_byte(*lock, F_WRLCK, 0) && ring_file_is_named(*lock, lock_path)) {
            return WHISKER_OK;
        }
        close(*lock); /* another process has it, or had it and has removed it */
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
    return WHISKER_ERROR_RING_BUSY;
}

static void ring_file_end_naming(const char *path, int lock)
{
    char lock_path[RING_PATH_BYTES];
    ring_file_lock_path(path, lock_path);
    unlink(lock_path);
    close(lock);
}

/* Whether this is a ring, of whatever version, and may be removed. */
static int ring_file_check_stale(int fd)
{
    uint64_t magic = 0;
    if (pread(fd, &magic, sizeof magic, 0) != sizeof magic || magic != RING_MAGIC) {
        return WHISKER_ERROR_RING_LAYOUT;
    }
    return ring_file_is_locked(fd, RING_LOCK_WRITER) ? WHISKER_ERROR_RING_BUSY : WHISKER_OK;
}

static int ring_file_remove_unlocked(const char *path)
{
    int fd;
    struct stat file;
    int error = ring_file_open(path, &fd, &file);
    if (error) {
        return error;
    }
    error = ring_file_check_stale(fd);
    if (!error && unlink(path) != 0) {
        error = ring_file_refusal();
    }
    close(fd);
    return error;
}

int ring_file_name(int fd, const char *path)
{
    char unnamed[64];
    int lock;
    int error = ring_file_begin_naming(path, &lock);
    if (error) {
        return error;
    }
    error = ring_file_remove_unlocked(path);
    if (error == WHISKER_ERROR_RING_MISSING) {
        error = WHISKER_OK;
    }
    snprintf(unnamed, sizeof unnamed, "/proc/self/fd/%d", fd);
    if (!error && linkat(AT_FDCWD, unnamed, AT_FDCWD, path, AT_SYMLINK_FOLLOW) != 0) {
        error = WHISKER_ERROR_SYSTEM;
    }
    ring_file_end_naming(path, lock);
    return error;
}

void ring_file_unname(int fd, const char *path)
{
    if (ring_file_is_named(fd, path)) { /* nobody else removes it while its writer lives */
        unlink(path);
    }
}
