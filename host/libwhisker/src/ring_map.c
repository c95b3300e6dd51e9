#include "ring_map.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "ring_guard.h"
#include "whisker/errors.h"

#define STAT_BLOCK_BYTES 512 /* of st_blocks, whatever the file system's are (stat(2)) */

static size_t ring_map_page_bytes(void)
{
    return (size_t)sysconf(_SC_PAGESIZE);
}

size_t ring_file_bytes(uint32_t capacity)
{
    return ring_map_page_bytes() + capacity * sizeof(struct whisker_frame);
}

static size_t ring_map_mapped_bytes(const struct ring_map *map)
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
    *map = (struct ring_map){.header_bytes = ring_map_page_bytes(), .capacity = capacity, .fd = fd};
    const int protection = writable ? PROT_READ | PROT_WRITE : PROT_READ;
    uint8_t *base =
        mmap(NULL, ring_map_mapped_bytes(map), PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (base == MAP_FAILED) {
        close(fd);
        return WHISKER_ERROR_MEMORY;
    }
    if (!map_over(base, map, protection) || !ring_guard_add(base, ring_map_mapped_bytes(map), protection)) {
        munmap(base, ring_map_mapped_bytes(map));
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
        munmap(map->header, ring_map_mapped_bytes(map));
        close(map->fd);
    }
    map->header = NULL;
}

static int ring_map_check_header(const struct ring_header *header, const struct stat *file)
{
    const uint32_t frames = header->capacity;
    if (header->magic != RING_MAGIC) {
        return WHISKER_ERROR_RING_LAYOUT;
    }
    if (header->version != RING_LAYOUT_VERSION) {
        return WHISKER_ERROR_RING_VERSION;
    }
    const bool sizes_fit = header->header_bytes == ring_map_page_bytes() &&
                           header->frame_bytes == sizeof(struct whisker_frame) && frames >= RING_CAPACITY_MIN &&
                           frames <= RING_CAPACITY_MAX && (frames & (frames - 1)) == 0 &&
                           (uint64_t)file->st_size == ring_file_bytes(frames);
    const bool counts_fit = header->head <= RING_COUNT_MAX && header->claim <= RING_COUNT_MAX;
    return sizes_fit && counts_fit ? WHISKER_OK : WHISKER_ERROR_RING_LAYOUT;
}

/* Mapping populates, and pages that the file lacks would be allotted for that: a small file with holes would cost its
 * readers the largest ring's memory. */
static bool ring_map_has_holes(const struct stat *file)
{
    return (uint64_t)file->st_blocks * STAT_BLOCK_BYTES < (uint64_t)file->st_size;
}

/* Read, not mapped: reading a file that becomes shorter meanwhile only gives less. */
int ring_map_check(int fd, const struct stat *file, uint32_t *capacity)
{
    struct ring_header header;
    if (pread(fd, &header, sizeof header, 0) != sizeof header) {
        return WHISKER_ERROR_RING_LAYOUT;
    }
    *capacity = header.capacity;
    const int error = ring_map_check_header(&header, file);
    return !error && ring_map_has_holes(file) ? WHISKER_ERROR_RING_LAYOUT : error;
}
