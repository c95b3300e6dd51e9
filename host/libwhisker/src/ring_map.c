#include "ring_map.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "whisker/errors.h"

int ring_path(const char *name, char path[RING_PATH_BYTES])
{
    const size_t length = name ? strlen(name) : 0;
    if (length == 0 || length > RING_PATH_BYTES - 2 || strchr(name, '/') || strcmp(name, ".") == 0 ||
        strcmp(name, "..") == 0) {
        return WHISKER_ERROR_RING_NAME;
    }
    snprintf(path, RING_PATH_BYTES, "/%s", name);
    return WHISKER_OK;
}

static size_t page_bytes(void)
{
    return (size_t)sysconf(_SC_PAGESIZE);
}

/* Header and frames at `base`, the frames once more behind them, over address space already reserved. */
static bool map_over(uint8_t *base, const struct ring_map *map, size_t frames_bytes, int protection)
{
    const size_t once = map->header_bytes + frames_bytes;
    const int flags = MAP_SHARED | MAP_FIXED;
    return mmap(base, once, protection, flags, map->fd, 0) != MAP_FAILED &&
           mmap(base + once, frames_bytes, protection, flags, map->fd, (off_t)map->header_bytes) != MAP_FAILED;
}

int ring_map(int fd, uint32_t capacity, bool writable, struct ring_map *map)
{
    *map = (struct ring_map){.header_bytes = page_bytes(), .capacity = capacity, .fd = fd};
    const size_t frames_bytes = capacity * sizeof(struct whisker_frame);
    const size_t all_bytes = map->header_bytes + 2 * frames_bytes;
    uint8_t *base = mmap(NULL, all_bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (base == MAP_FAILED) {
        close(fd);
        return WHISKER_ERROR_MEMORY;
    }
    if (!map_over(base, map, frames_bytes, writable ? PROT_READ | PROT_WRITE : PROT_READ)) {
        munmap(base, all_bytes);
        close(fd);
        return WHISKER_ERROR_MEMORY;
    }
    map->header = (struct ring_header *)(void *)base;
    map->frames = (struct whisker_frame *)(void *)(base + map->header_bytes);
    return WHISKER_OK;
}

void ring_unmap(struct ring_map *map)
{
    if (map->header) {
        munmap(map->header, map->header_bytes + 2 * map->capacity * sizeof(struct whisker_frame));
        close(map->fd);
    }
    map->header = NULL;
}

static int check_header(const struct ring_header *header, off_t file_bytes, uint32_t *capacity)
{
    const uint64_t magic = ring_load_acquire(&header->magic);
    if (magic == 0) { /* its writer has not finished making it */
        return WHISKER_ERROR_RING_MISSING;
    }
    if (magic != RING_MAGIC) {
        return WHISKER_ERROR_RING_LAYOUT;
    }
    if (header->version != RING_LAYOUT_VERSION) {
        return WHISKER_ERROR_RING_VERSION;
    }
    const uint32_t frames = *capacity = header->capacity;
    const bool sizes_fit = header->header_bytes == page_bytes() &&
                           header->frame_bytes == sizeof(struct whisker_frame) && frames >= RING_CAPACITY_MIN &&
                           frames <= RING_CAPACITY_MAX && (frames & (frames - 1)) == 0 &&
                           (uint64_t)file_bytes == page_bytes() + (uint64_t)frames * sizeof(struct whisker_frame);
    return sizes_fit ? WHISKER_OK : WHISKER_ERROR_RING_LAYOUT;
}

/* Reads the capacity from the header page alone: how much to map is not known before. */
static int read_capacity(int fd, uint32_t *capacity)
{
    struct stat file;
    if (fstat(fd, &file) != 0) {
        return WHISKER_ERROR_SYSTEM;
    }
    if (file.st_size == 0) {
        return WHISKER_ERROR_RING_MISSING;
    }
    if ((size_t)file.st_size < page_bytes()) {
        return WHISKER_ERROR_RING_LAYOUT;
    }
    const struct ring_header *header = mmap(NULL, page_bytes(), PROT_READ, MAP_SHARED, fd, 0);
    if (header == MAP_FAILED) {
        return WHISKER_ERROR_MEMORY;
    }
    const int error = check_header(header, file.st_size, capacity);
    munmap((void *)header, page_bytes());
    return error;
}

int ring_map_existing(const char *path, struct ring_map *map)
{
    map->header = NULL;
    const int fd = shm_open(path, O_RDONLY | O_CLOEXEC, 0);
    if (fd < 0) {
        return errno == ENOENT ? WHISKER_ERROR_RING_MISSING : WHISKER_ERROR_SYSTEM;
    }
    uint32_t capacity;
    const int error = read_capacity(fd, &capacity);
    if (error) {
        close(fd);
        return error;
    }
    return ring_map(fd, capacity, false, map);
}

bool ring_lock_writer(int fd)
{
    struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET, .l_start = 0, .l_len = 1};
    return fcntl(fd, F_OFD_SETLK, &lock) == 0;
}

bool ring_writer_lives(int fd)
{
    struct flock lock = {.l_type = F_RDLCK, .l_whence = SEEK_SET, .l_start = 0, .l_len = 1};
    return fcntl(fd, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

bool ring_is_named(int fd, const char *path)
{
    struct stat mine, named;
    const int other = shm_open(path, O_RDONLY | O_CLOEXEC, 0);
    if (other < 0) {
        return false;
    }
    const bool same = fstat(fd, &mine) == 0 && fstat(other, &named) == 0 && mine.st_dev == named.st_dev &&
                      mine.st_ino == named.st_ino;
    close(other);
    return same;
}
