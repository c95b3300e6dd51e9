#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "futex.h"
#include "ring_internal.h"
#include "whisker/errors.h"

/* A dead writer wakes nobody, so a waiting reader looks for itself this often. */
#define LIVENESS_MS 100
/* How often attach looks for a ring that is not there yet. */
#define ATTACH_MS 5

/* Milliseconds of the monotonic clock. */
static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* How long to sleep now: at most `step`, at most what is left of the timeout; 0 when that is over. */
static int sleep_ms(int timeout_ms, int64_t started_ms, int step)
{
    if (timeout_ms < 0) {
        return step;
    }
    const int64_t left = timeout_ms - (now_ms() - started_ms);
    return left <= 0 ? 0 : left < step ? (int)left : step;
}

static int map_living(const char *path, struct ring_map *map)
{
    const int error = ring_map_existing(path, map);
    if (!error && !ring_writer_lives(map->fd)) {
        ring_unmap(map);
        return WHISKER_ERROR_WRITER_DEAD;
    }
    return error;
}

/* Waits for a ring to come up: one that is missing, or whose writer is dead, may be made anew at any time. */
static int map_awaited(const char *path, int timeout_ms, struct ring_map *map)
{
    const int64_t started = timeout_ms > 0 ? now_ms() : 0;
    for (;;) {
        const int error = map_living(path, map);
        if (error != WHISKER_ERROR_RING_MISSING && error != WHISKER_ERROR_WRITER_DEAD) {
            return error;
        }
        const int step = sleep_ms(timeout_ms, started, ATTACH_MS);
        if (step == 0) {
            return error;
        }
        nanosleep(&(struct timespec){.tv_nsec = step * 1000000L}, NULL);
    }
}

/* The oldest frame that is still whole. */
static uint64_t oldest(const struct ring_map *map)
{
    const uint64_t claim = ring_load_acquire(&map->header->claim);
    return claim > map->capacity ? claim - map->capacity : 0;
}

static void start_reading(struct whisker_reader *reader)
{
    reader->generation = reader->map.header->generation;
    reader->position = oldest(&reader->map);
    reader->peeked = 0;
    reader->has_sequence = false;
}

int whisker_reader_attach(const char *name, int timeout_ms, struct whisker_reader **reader)
{
    *reader = NULL;
    struct whisker_reader *made = calloc(1, sizeof *made);
    if (!made) {
        return WHISKER_ERROR_MEMORY;
    }
    int error = ring_path(name, made->path);
    if (!error) {
        error = map_awaited(made->path, timeout_ms, &made->map);
    }
    if (error) {
        free(made);
        return error;
    }
    start_reading(made);
    *reader = made;
    return WHISKER_OK;
}

int whisker_reader_reattach(struct whisker_reader *reader, int timeout_ms)
{
    struct ring_map map;
    const int error = map_awaited(reader->path, timeout_ms, &map);
    if (error) {
        return error;
    }
    ring_unmap(&reader->map);
    reader->map = map;
    start_reading(reader);
    return WHISKER_OK;
}

void whisker_reader_detach(struct whisker_reader *reader)
{
    if (reader) {
        ring_unmap(&reader->map);
        free(reader);
    }
}

/* The writer has, or may have, written over the reader's next frame. Not believing the shared numbers costs nothing. */
static bool overrun(const struct whisker_reader *reader)
{
    ring_fence_after_reading();
    return ring_load(&reader->map.header->claim) - reader->position > reader->map.capacity;
}

/* Half a ring behind the writer, so that the next overrun is not at once. */
static int skip_lost(struct whisker_reader *reader)
{
    const uint64_t head = ring_load_acquire(&reader->map.header->head);
    const uint64_t target = head - reader->map.capacity / 2;
    if (head > reader->map.capacity / 2 && target > reader->position) {
        reader->frames_overrun += target - reader->position;
        reader->position = target;
    }
    reader->overruns++;
    reader->has_sequence = false;
    reader->peeked = 0;
    return WHISKER_ERROR_OVERRUN;
}

int whisker_reader_peek(struct whisker_reader *reader, const struct whisker_frame **frames, size_t *count)
{
    const uint64_t head = ring_load_acquire(&reader->map.header->head);
    *frames = &reader->map.frames[reader->position & (reader->map.capacity - 1)];
    *count = 0;
    if (overrun(reader) || head - reader->position > reader->map.capacity) {
        return skip_lost(reader);
    }
    reader->peeked = head - reader->position;
    *count = reader->peeked;
    return WHISKER_OK;
}

int whisker_reader_advance(struct whisker_reader *reader, size_t count)
{
    if (count > reader->peeked) {
        return WHISKER_ERROR_ARGUMENT;
    }
    if (count == 0) {
        return WHISKER_OK;
    }
    const uint32_t sequence = reader->map.frames[(reader->position + count - 1) & (reader->map.capacity - 1)].sequence;
    const uint32_t first = reader->map.frames[reader->position & (reader->map.capacity - 1)].sequence;
    if (overrun(reader)) {
        return skip_lost(reader);
    }
    /* Differences modulo 2^32, for the sequence number wraps. Less than nothing missing is a bridge that restarted. */
    const uint32_t before = reader->has_sequence ? reader->sequence : first - 1;
    const uint32_t missing = sequence - before - (uint32_t)count;
    reader->frames_missing += missing < UINT32_MAX / 2 ? missing : 0;
    reader->sequence = sequence;
    reader->has_sequence = true;
    reader->position += count;
    reader->peeked -= count;
    return WHISKER_OK;
}

void whisker_reader_seek_latest(struct whisker_reader *reader, size_t count)
{
    const uint64_t head = ring_load_acquire(&reader->map.header->head);
    if (head > count && head - count > reader->position) {
        reader->position = head - count;
        reader->has_sequence = false;
    }
    reader->peeked = 0;
}

/* 0: there is something to peek; TIMEOUT: not yet; CLOSED: never again. The state is read before the head, so frames
 * published before the close are not missed. */
static int look(const struct whisker_reader *reader)
{
    const uint64_t state = ring_load_acquire(&reader->map.header->state);
    if (ring_load_acquire(&reader->map.header->head) != reader->position) {
        return WHISKER_OK;
    }
    return state == RING_CLOSED ? WHISKER_ERROR_CLOSED : WHISKER_ERROR_TIMEOUT;
}

/* As look, with the writer's life: when it is over, what it published last is seen by looking once more. */
static int look_closely(const struct whisker_reader *reader)
{
    int seen = look(reader);
    if (seen == WHISKER_ERROR_TIMEOUT && !ring_writer_lives(reader->map.fd)) {
        seen = look(reader);
        seen = seen == WHISKER_ERROR_TIMEOUT ? WHISKER_ERROR_WRITER_DEAD : seen;
    }
    return seen;
}

/* An ended ring: does its name belong to a new one? */
static int ended(const struct whisker_reader *reader, int error)
{
    struct ring_map other;
    if (ring_is_named(reader->map.fd, reader->path) || map_living(reader->path, &other) != WHISKER_OK) {
        return error;
    }
    ring_unmap(&other);
    return WHISKER_ERROR_RESTARTED;
}

int whisker_reader_wait(struct whisker_reader *reader, int timeout_ms)
{
    const int64_t started = timeout_ms > 0 ? now_ms() : 0;
    for (;;) {
        const uint32_t signal = ring_signal_load(&reader->map.header->signal);
        const int seen = look_closely(reader);
        if (seen == WHISKER_OK) {
            return WHISKER_OK;
        }
        if (seen != WHISKER_ERROR_TIMEOUT) {
            return ended(reader, seen);
        }
        const int step = sleep_ms(timeout_ms, started, LIVENESS_MS);
        if (step == 0) {
            return WHISKER_ERROR_TIMEOUT;
        }
        futex_wait(&reader->map.header->signal, signal, step);
    }
}

void whisker_reader_info(const struct whisker_reader *reader, struct whisker_reader_info *info)
{
    *info = (struct whisker_reader_info){
        .generation = reader->generation,
        .published = ring_load_acquire(&reader->map.header->head),
        .position = reader->position,
        .overruns = reader->overruns,
        .frames_overrun = reader->frames_overrun,
        .frames_missing = reader->frames_missing,
        .capacity = reader->map.capacity,
        .writer_pid = reader->map.header->writer_pid,
    };
}

int whisker_reader_clock(const struct whisker_reader *reader, struct whisker_clock *clock)
{
    const struct ring_header *header = reader->map.header;
    return ring_cell_get(&header->clock.version, header->clock.copy[0], clock, sizeof *clock);
}

int whisker_reader_stats(const struct whisker_reader *reader, struct whisker_daemon_stats *stats)
{
    const struct ring_header *header = reader->map.header;
    return ring_cell_get(&header->stats.version, header->stats.copy[0], stats, sizeof *stats);
}
