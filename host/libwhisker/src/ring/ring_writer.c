#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "futex.h"
#include "ring_internal.h"
#include "ring_nodes.h"
#include "whisker/errors.h"

static uint64_t ring_writer_nanoseconds_since_boot(void)
{
    struct timespec now;
    clock_gettime(CLOCK_BOOTTIME, &now);
    return (uint64_t)now.tv_sec * UINT64_C(1000000000) + (uint64_t)now.tv_nsec;
}

static void ring_writer_fill_header(const struct ring_map *map)
{
    struct ring_header *header = map->header;
    header->version = RING_LAYOUT_VERSION;
    header->header_bytes = (uint32_t)map->header_bytes;
    header->frame_bytes = sizeof(struct whisker_frame);
    header->capacity = map->capacity;
    header->generation = ring_writer_nanoseconds_since_boot();
    header->writer_pid = (uint32_t)getpid();
    ring_store(&header->state, RING_OPEN);
    ring_store(&header->magic, RING_MAGIC);
}

/* The file gets its name when nothing is missing, so there is no ring half made. */
static int ring_writer_make_ring(const char *path, const char *directory, uint32_t capacity, struct ring_map *map)
{
    int fd;
    int error = ring_file_make(directory, ring_file_bytes(capacity), &fd);
    if (error) {
        return error;
    }
    error = ring_map(fd, capacity, true, map);
    if (error) {
        return error;
    }
    ring_writer_fill_header(map);
    error = ring_file_lock(fd, RING_LOCK_WRITER) ? ring_file_name(fd, path) : WHISKER_ERROR_SYSTEM;
    if (error) {
        ring_unmap(map);
    }
    return error;
}

/* The place of this directory, or RING_PLACES. */
static enum ring_place ring_writer_place_of(const char *directory)
{
    enum ring_place place = 0;
    while (place < RING_PLACES && strcmp(directory, ring_directories[place]) != 0) {
        place++;
    }
    return place;
}

/* Whether readers would find another ring of this name first. */
static bool ring_writer_is_hidden(const char *name, enum ring_place place)
{
    char path[RING_PATH_BYTES];
    bool hidden = false;
    for (enum ring_place before = 0; before < place; before++) {
        hidden |= ring_path(name, before, path) == WHISKER_OK && ring_lives(path);
    }
    return hidden;
}

static int create_at(enum ring_place place, const char *name, uint32_t capacity, struct whisker_ring *ring)
{
    const int error = ring_path(name, place, ring->path);
    if (error) {
        return error;
    }
    return ring_writer_is_hidden(name, place)
               ? WHISKER_ERROR_RING_BUSY
               : ring_writer_make_ring(ring->path, ring_directories[place], capacity, &ring->map);
}

int whisker_ring_create_in(const char *directory, const char *name, uint32_t capacity, struct whisker_ring **ring)
{
    const enum ring_place place = ring_writer_place_of(directory);
    *ring = NULL;
    if (place == RING_PLACES || capacity < RING_CAPACITY_MIN || capacity > RING_CAPACITY_MAX ||
        (capacity & (capacity - 1)) != 0) {
        return WHISKER_ERROR_ARGUMENT;
    }
    struct whisker_ring *made = calloc(1, sizeof *made);
    if (!made) {
        return WHISKER_ERROR_MEMORY;
    }
    const int error = create_at(place, name, capacity, made);
    if (error) {
        free(made);
        return error;
    }
    *ring = made;
    return WHISKER_OK;
}

int whisker_ring_create(const char *name, uint32_t capacity, struct whisker_ring **ring)
{
    return whisker_ring_create_in(ring_directories[RING_PLACE_SHARED], name, capacity, ring);
}

/* Where the next frames go, as one array; readers know from now on that these places change. NULL: too many. */
static struct whisker_frame *ring_writer_reserve(struct whisker_ring *ring, size_t count)
{
    if (count > ring->map.capacity / 4) {
        return NULL;
    }
    if (ring->head + count > ring->claim) {
        const uint64_t step = ring->map.capacity / RING_CLAIM_PARTS;
        ring->claim = (ring->head + count + step - 1) / step * step;
        ring_store_release(&ring->map.header->claim, ring->claim); /* who sees it sees the head before it, too */
    }
    ring_fence_before_writing();
    return &ring->map.frames[ring->head & (ring->map.capacity - 1)];
}

/* Asked of the kernel once per tick of its clock, for the answer costs a system call. A reader that has just begun to
 * wait does not rely on being woken before the next tick. */
static bool ring_writer_readers_wait(struct whisker_ring *ring)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC_COARSE, &now);
    if (now.tv_nsec != ring->asked.tv_nsec || now.tv_sec != ring->asked.tv_sec) {
        ring->asked = now;
        ring->readers_wait = ring_file_is_locked(ring->map.fd, RING_LOCK_WAITING);
    }
    return ring->readers_wait;
}

static int ring_writer_commit(struct whisker_ring *ring, size_t count)
{
    struct ring_header *header = ring->map.header;
    if (count > 0) {
        ring->head += count;
        ring_store_release(&header->head, ring->head);
        ring_signal_raise(&header->signal);
        if (ring_writer_readers_wait(ring)) {
            futex_wake_all(&header->signal);
        }
    }
    return ring_is_whole(&ring->map) ? WHISKER_OK : WHISKER_ERROR_RING_LOST;
}

int whisker_ring_publish(struct whisker_ring *ring, const struct whisker_frame *frames, size_t count)
{
    struct whisker_frame *place = ring_writer_reserve(ring, count);
    if (!place) {
        return WHISKER_ERROR_ARGUMENT;
    }
    memcpy(place, frames, count * sizeof *frames);
    return ring_writer_commit(ring, count);
}

int whisker_ring_feed(struct whisker_ring *ring, struct whisker_decoder *decoder, const uint8_t *bytes, size_t count,
                      const struct whisker_frame **frames, size_t *made)
{
    /* The decoder may hold all but one byte of a frame. */
    struct whisker_frame *place = ring_writer_reserve(ring, count / sizeof *place + 1);
    if (!place) {
        return WHISKER_ERROR_ARGUMENT;
    }
    size_t decoded = 0;
    while (whisker_decoder_next(decoder, &bytes, &count, &place[decoded])) {
        decoded++;
    }
    if (frames) {
        *frames = place;
        *made = decoded;
    }
    return ring_writer_commit(ring, decoded);
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
    struct ring_header *header = ring->map.header;
    ring_nodes_remove(ring->path);
    ring_file_unname(ring->map.fd, ring->path);
    ring_store_release(&header->state, RING_CLOSED);
    ring_signal_raise(&header->signal);
    futex_wake_all(&header->signal);
    ring_unmap(&ring->map);
    free(ring);
}
