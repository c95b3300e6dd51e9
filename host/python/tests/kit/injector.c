/* A disk that fails, for LD_PRELOAD: counts the file operations of this process below one folder, and ends the process
 * or fails the operation at the one that is asked for. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define KILLED 137
#define DESCRIPTORS 1024

static char root[PATH_MAX];
static long count, at;
static int fails; /* 0: the process ends; else the errno of the operation, and of all behind it where `lasts` */
static bool lasts, watched[DESCRIPTORS];

/* fail_errno 0: end. at 0: only count. */
void injector_arm(const char *folder, long at_operation, int fail_errno, int is_lasting)
{
    snprintf(root, sizeof root, "%s", folder);
    count = 0;
    at = at_operation;
    fails = fail_errno;
    lasts = is_lasting != 0;
}

long injector_count(void)
{
    return count;
}

static bool is_below(const char *path)
{
    return root[0] && path && (path[0] != '/' || strncmp(path, root, strlen(root)) == 0);
}

/* Whether the operation fails; errno is set. */
static bool strikes(bool is_counted)
{
    if (!is_counted || !root[0]) {
        return false;
    }
    count++;
    if (at == 0 || count < at || (count > at && !lasts)) {
        return false;
    }
    if (fails == 0) {
        _exit(KILLED);
    }
    errno = fails;
    return true;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static int noted(int fd, bool is_counted)
{
    if (fd >= 0 && fd < DESCRIPTORS) {
        watched[fd] = is_counted;
    }
    return fd;
}

static bool is_watched(int fd)
{
    return fd >= 0 && fd < DESCRIPTORS && watched[fd];
}

#define OPEN(name)                                                                                                     \
    int name(const char *path, int flags, ...)                                                                         \
    {                                                                                                                  \
        va_list more;                                                                                                  \
        va_start(more, flags);                                                                                         \
        const mode_t mode = va_arg(more, mode_t);                                                                      \
        va_end(more);                                                                                                  \
        const bool is_counted = is_below(path) && ((flags & O_ACCMODE) != O_RDONLY || fails == EMFILE);                \
        return strikes(is_counted) ? -1 : noted(REAL(name)(path, flags, mode), is_counted);                            \
    }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                                                                                   \
    int name(int folder, const char *path, int flags, ...)                                                             \
    {                                                                                                                  \
        va_list more;                                                                                                  \
        va_start(more, flags);                                                                                         \
        const mode_t mode = va_arg(more, mode_t);                                                                      \
        va_end(more);                                                                                                  \
        const bool is_counted = is_below(path) && (flags & O_ACCMODE) != O_RDONLY;                                     \
        return strikes(is_counted) ? -1 : noted(REAL(name)(folder, path, flags, mode), is_counted);                    \
    }
OPENAT(openat)
OPENAT(openat64)

#define FOPEN(name)                                                                                                    \
    FILE *name(const char *path, const char *mode)                                                                     \
    {                                                                                                                  \
        const bool is_counted = is_below(path) && mode[0] != 'r';                                                      \
        FILE *file = strikes(is_counted) ? NULL : REAL(name)(path, mode);                                              \
        if (file) {                                                                                                    \
            noted(fileno(file), is_counted);                                                                           \
        }                                                                                                              \
        return file;                                                                                                   \
    }
FOPEN(fopen)
FOPEN(fopen64)

int close(int fd)
{
    noted(fd, false);
    return REAL(close)(fd);
}

/* A process that is ended in a write has written half of it. */
ssize_t write(int fd, const void *data, size_t size)
{
    if (is_watched(fd) && root[0] && fails == 0 && count + 1 == at) {
        (void)!REAL(write)(fd, data, size / 2);
    }
    return strikes(is_watched(fd)) ? -1 : REAL(write)(fd, data, size);
}

ssize_t pwrite64(int fd, const void *data, size_t size, off64_t place)
{
    return strikes(is_watched(fd)) ? -1 : REAL(pwrite64)(fd, data, size, place);
}

int fsync(int fd)
{
    return strikes(true) ? -1 : REAL(fsync)(fd);
}

int fdatasync(int fd)
{
    return strikes(true) ? -1 : REAL(fdatasync)(fd);
}

int ftruncate64(int fd, off64_t size)
{
    return strikes(is_watched(fd)) ? -1 : REAL(ftruncate64)(fd, size);
}

int rename(const char *from, const char *to)
{
    return strikes(is_below(from)) ? -1 : REAL(rename)(from, to);
}

int renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags)
{
    return strikes(is_below(from)) ? -1 : REAL(renameat2)(from_folder, from, to_folder, to, flags);
}

int unlink(const char *path)
{
    return strikes(is_below(path)) ? -1 : REAL(unlink)(path);
}

int unlinkat(int folder, const char *path, int flags)
{
    return strikes(is_below(path)) ? -1 : REAL(unlinkat)(folder, path, flags);
}

int rmdir(const char *path)
{
    return strikes(is_below(path)) ? -1 : REAL(rmdir)(path);
}

int mkdir(const char *path, mode_t mode)
{
    return strikes(is_below(path)) ? -1 : REAL(mkdir)(path, mode);
}
