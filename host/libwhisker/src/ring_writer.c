#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "futex.h"
#include "ring_internal.h"
#include "whisker/errors.h"

/* Removes what a dead writer left. RING_BUSY: it is not dead. 0 also when another process was faster: try again. */
static int remove_stale(const char *path)
{
    const int fd = shm_open(path, O_RDWR | O_CLOEXEC, 0);
    if (fd < 0) {
        return errno == ENOENT ? WHISKER_OK : WHISKER_ERROR_SYSTEM;
    }
    if (!ring_lock_writer(fd)) {
        close(fd);
        return WHISKER_ERROR_RING_BUSY;
    }
    if (ring_is_named(fd, path)) { /* nobody else can remove it while we hold its lock */
        shm_unlink(path);
    }
    close(fd);
    return WHISKER_OK;
}

/* A new, empty, locked file under this name. */
static int make_file(const char *path, int *fd)
{
    for (;;) {
        *fd = shm_open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH);
        if (*fd >= 0) {
            if (ring_lock_writer(*fd) && ring_is_named(*fd, path)) {
                return WHISKER_OK;
            }
            close(*fd); /* another writer took it for stale before it was locked */
            continue;
        }
        const int error = errno == EEXIST ? remove_stale(path) : WHISKER_ERROR_SYSTEM;
        if (error) {
            return error;
        }
    }
}

static uint64_t nanoseconds_since_boot(void)
{
    struct timespec now;
    clock_gettime(CLOCK_BOOTTIME, &now);
    return (uint64_t)now.tv_sec * UINT64_C(1000000000) + (uint64_t)now.tv_nsec;
}

static void fill_header(const struct ring_map *map)
{
    struct ring_header *header = map->header;
    header->version = RING_LAYOUT_VERSION;
    header->header_bytes = (uint32_t)map->header_bytes;
    header->frame_bytes = sizeof(struct whisker_frame);
    header->capacity = map->capacity;
    header->generation = nanoseconds_since_boot();
    header->writer_pid = (uint32_t)getpid();
    ring_store(&header->state, RING_OPEN);
    ring_store_release(&header->magic, RING_MAGIC);
}

/* Memory is allotted here: a full /dev/shm shall fail now and not kill the writer at its first frame. */
static int make_ring(const char *path, uint32_t capacity, struct ring_map *map)
{
    int fd;
    int error = make_file(path, &fd);
    if (error) {
        return error;
    }
    const size_t bytes = (size_t)sysconf(_SC_PAGESIZE) + capacity * sizeof(struct whisker_frame);
    if (posix_fallocate(fd, 0, (off_t)bytes) != 0) {
        shm_unlink(path);
        close(fd);
        return WHISKER_ERROR_MEMORY;
    }
    error = ring_map(fd, capacity, true, map);
    if (error) {
        shm_unlink(path);
        return error;
    }
    fill_header(map);
    return WHISKER_OK;
}

int whisker_ring_create(const char *name, uint32_t capacity, struct whisker_ring **ring)
{
    *ring = NULL;
    if (capacity < RING_CAPACITY_MIN || capacity > RING_CAPACITY_MAX || (capacity & (capacity - 1)) != 0) {
        return WHISKER_ERROR_ARGUMENT;
    }
    struct whisker_ring *made = calloc(1, sizeof *made);
    if (!made) {
        return WHISKER_ERROR_MEMORY;
    }
    int error = ring_path(name, made->path);
    if (!error) {
        error = make_ring(made->path, capacity, &made->map);
    }
    if (error) {
        free(made);
        return error;
    }
    *ring = made;
    return WHISKER_OK;
}

/* Where the next frames go, as one array; readers know from now on that these places change. NULL: too many. */
static struct whisker_frame *reserve(struct whisker_ring *ring, size_t count)
{
    if (count > ring->map.capacity / 4) {
        return NULL;
    }
    if (ring->head + count > ring->claim) {
        ring->claim = ring->head + count;
        ring_store(&ring->map.header->claim, ring->claim);
    }
    ring_fence_before_writing();
    return &ring->map.frames[ring->head & (ring->map.capacity - 1)];
}

static void wake(struct ring_header *header)
{
    ring_signal_raise(&header->signal);
    futex_wake_all(&header->signal);
}

static void commit(struct whisker_ring *ring, size_t count)
{
    if (count > 0) {
        ring->head += count;
        ring_store_release(&ring->map.header->head, ring->head);
        wake(ring->map.header);
    }
}

int whisker_ring_publish(struct whisker_ring *ring, const struct whisker_frame *frames, size_t count)
{
    struct whisker_frame *place = reserve(ring, count);
    if (!place) {
        return WHISKER_ERROR_ARGUMENT;
    }
    memcpy(place, frames, count * sizeof *frames);
    commit(ring, count);
    return WHISKER_OK;
}

int whisker_ring_feed(struct whisker_ring *ring, struct whisker_decoder *decoder, const uint8_t *bytes, size_t count,
                      const struct whisker_frame **frames, size_t *made)
{
    /* The decoder may hold all but one byte of a frame. */
    struct whisker_frame *place = reserve(ring, count / sizeof *place + 1);
    if (!place) {
        return WHISKER_ERROR_ARGUMENT;
    }
    size_t decoded = 0;
    while (whisker_decoder_next(decoder, &bytes, &count, &place[decoded])) {
        decoded++;
    }
    commit(ring, decoded);
    if (frames) {
        *frames = place;
        *made = decoded;
    }
    return WHISKER_OK;
}

void whisker_ring_set_clock(struct whisker_ring *ring, const struct whisker_clock *clock)
{
    struct ring_header *header = ring->map.header;
    ring_cell_set(&header->clock.version, header->clock.copy[0], clock, sizeof *clock);
}

void whisker_ring_set_stats(struct whisker_ring *ring, const struct whisker_daemon_stats *stats)
{
    struct ring_header *header = ring->map.header;
    ring_cell_set(&header->stats.version, header->stats.copy[0], stats, sizeof *stats);
}

void whisker_ring_close(struct whisker_ring *ring)
{
    if (!ring) {
        return;
    }
    if (ring_is_named(ring->map.fd, ring->path)) {
        shm_unlink(ring->path);
    }
    ring_store_release(&ring->map.header->state, RING_CLOSED);
    wake(ring->map.header);
    ring_unmap(&ring->map);
    free(ring);
}
