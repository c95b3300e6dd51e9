#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "ring_layout.h"
#include "ring_map.h"
#include "whisker/errors.h"
#include "whisker/ring.h"

/* "/proc/", a process id, "/fdinfo/", a number */
#define PROC_PATH_BYTES 64

/* Whether a line of /proc/PID/fdinfo/N says that the writer's lock is held through this open file (proc(5)). The lock
 * says so of itself: it belongs to an open file, so neither F_OFD_GETLK nor /proc/locks names a process. */
static bool ring_signal_is_writer_lock(const char *line)
{
    uint64_t first;
    return sscanf(line, "lock: %*d: OFDLCK %*s WRITE %*d %*[^ ] %" SCNu64, &first) == 1 && first == RING_LOCK_WRITER;
}

static bool ring_signal_holds_lock(uint32_t pid, const char *number)
{
    char path[PROC_PATH_BYTES], line[256];
    snprintf(path, sizeof path, "/proc/%" PRIu32 "/fdinfo/%.10s", pid, number);
    FILE *info = fopen(path, "re");
    bool holds = false;
    while (info && !holds && fgets(line, sizeof line, info)) {
        holds = ring_signal_is_writer_lock(line);
    }
    if (info) {
        fclose(info);
    }
    return holds;
}

/* Whether this process has the ring's file open and its writer's lock through it. 0, RING_WRITER, or RING_ACCESS: this
 * user may not look. */
static int ring_signal_check_writer(uint32_t pid, const struct stat *ring)
{
    char path[PROC_PATH_BYTES];
    struct stat file;
    snprintf(path, sizeof path, "/proc/%" PRIu32 "/fd", pid);
    DIR *directory = opendir(path);
    if (!directory) {
        return errno == EACCES ? WHISKER_ERROR_RING_ACCESS : WHISKER_ERROR_RING_WRITER;
    }
    int error = WHISKER_ERROR_RING_WRITER;
    for (const struct dirent *entry; error && (entry = readdir(directory));) {
        const bool is_ring = isdigit((unsigned char)entry->d_name[0]) &&
                             fstatat(dirfd(directory), entry->d_name, &file, 0) == 0 && ring_file_is_same(&file, ring);
        error = is_ring && ring_signal_holds_lock(pid, entry->d_name) ? WHISKER_OK : WHISKER_ERROR_RING_WRITER;
    }
    closedir(directory);
    return error;
}

/* The process is taken hold of before it is checked. Its number cannot pass to another one unnoticed: if it ends
 * meanwhile, the signal reaches nobody. */
static int signal_process(uint32_t pid, const struct stat *ring, int number)
{
    const int process = pid > 1 && pid <= INT32_MAX ? (int)syscall(SYS_pidfd_open, (pid_t)pid, 0) : -1;
    if (process < 0) {
        return WHISKER_ERROR_RING_WRITER;
    }
    int error = ring_signal_check_writer(pid, ring);
    if (!error && syscall(SYS_pidfd_send_signal, process, number, NULL, 0) != 0) {
        error = errno == EPERM ? WHISKER_ERROR_RING_ACCESS : WHISKER_ERROR_RING_WRITER;
    }
    close(process);
    return error;
}

int whisker_ring_signal_writer(const char *name, int number)
{
    struct ring_found found;
    struct ring_header header;
    int error = ring_find(name, WHISKER_RING_NO_OWNER, &found);
    if (error) {
        return error;
    }
    const bool reported = pread(found.fd, &header, sizeof header, 0) == sizeof header;
    error = reported ? signal_process(header.writer_pid, &found.file, number) : WHISKER_ERROR_RING_LAYOUT;
    close(found.fd);
    return error;
}
