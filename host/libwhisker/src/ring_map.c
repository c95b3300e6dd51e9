#include "ring_map.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "ring_guard.h"
#include "whisker/errors.h"

static size_t page_bytes(void)
{
    return (size_t)sysconf(_SC_PAGESIZE);
}

size_t ring_file_bytes(uint32_t capacity)
{
    return page_bytes() + capacity * sizeof(struct whisker_frame);
}

static size_t mapped_bytes(const struct ring_map *map)
{
    return map->header_bytes + 2 * map->capacity * sizeof(struct whisker_frame);
}

/* Header and frames at `base`, the frames once more behind them, over address space already reserved. Populated: else
 * every 16th frame of the first round would wait for a page fault. */
static bool map_over(uint8_t *base, const struct ring_map *map, int protection)
{
    const size_t once = ring_file_bytes(map->capacity);
    const int flags = MAP_SHARED | MAP_FIXED | MAP_POPULATE;
    return mmap(base, once, protection, flags, map->fd, 0) != MAP_FAILED &&
           mmap(base + once, once - map->header_bytes, protection, flags, map->fd, (off_t)map->header_bytes) !=
               MAP_FAILED;
}

int ring_map(int fd, uint32_t capacity, bool writable, struct ring_map *map)
{
    *map = (struct ring_map){.header_bytes = page_bytes(), .capacity = capacity, .fd = fd};
    const int protection = writable ? PROT_READ | PROT_WRITE : PROT_READ;
    uint8_t *base = mmap(NULL, mapped_bytes(map), PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (base == MAP_FAILED) {
        close(fd);
        return WHISKER_ERROR_MEMORY;
    }
    if (!map_over(base, map, protection) || !ring_guard_add(base, mapped_bytes(map), protection)) {
        munmap(base, mapped_bytes(map));
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
        ring_guard_remove(map->header);
        munmap(map->header, mapped_bytes(map));
        close(map->fd);
    }
    map->header = NULL;
}

static int check_header(const struct ring_header *header, off_t file_bytes)
{
    const uint32_t frames = header->capacity;
    if (header->magic != RING_MAGIC) {
        return WHISKER_ERROR_RING_LAYOUT;
    }
    if (header->version != RING_LAYOUT_VERSION) {
        return WHISKER_ERROR_RING_VERSION;
    }
    const bool sizes_fit = header->header_bytes == page_bytes() &&
                           header->frame_bytes == sizeof(struct whisker_frame) && frames >= RING_CAPACITY_MIN &&
                           frames <= RING_CAPACITY_MAX && (frames & (frames - 1)) == 0 &&
                           (uint64_t)file_bytes == ring_file_bytes(frames);
    return sizes_fit ? WHISKER_OK : WHISKER_ERROR_RING_LAYOUT;
}

/* Read, not mapped: reading a file that becomes shorter meanwhile only gives less. */
static int read_capacity(int fd, uint32_t *capacity)
{
    struct stat file;
    struct ring_header header;
    if (fstat(fd, &file) != 0) {
        return WHISKER_ERROR_SYSTEM;
    }
    if (pread(fd, &header, sizeof header, 0) != sizeof header) {
        return WHISKER_ERROR_RING_LAYOUT;
    }
    *capacity = header.capacity;
    return check_header(&header, file.st_size);
}

int ring_map_existing(const char *path, struct ring_map *map)
{
    map->header = NULL;
    int fd;
    int error = ring_file_open(path, &fd);
    if (error) {
        return error;
    }
    uint32_t capacity;
    error = read_capacity(fd, &capacity);
    if (error) {
        close(fd);
        return error;
    }
    return ring_map(fd, capacity, false, map);
}
