#include <stdlib.h>

#include "ring_internal.h"
#include "ring_time.h"
#include "whisker/errors.h"

/* How often attach looks for a ring that is not there yet. */
#define ATTACH_MS 5

int ring_map_living(const char *path, struct ring_map *map)
{
    const int error = ring_map_existing(path, map);
    if (!error && !ring_file_is_locked(map->fd, RING_LOCK_WRITER)) {
        ring_unmap(map);
        return WHISKER_ERROR_WRITER_DEAD;
    }
    return error;
}

/* Waits for a ring to come up: one that is missing, or whose writer is dead, may be made anew at any time. */
static int map_awaited(const char *path, int timeout_ms, struct ring_map *map)
{
    const int64_t started = timeout_ms > 0 ? ring_now_ms() : 0;
    for (;;) {
        const int error = ring_map_living(path, map);
        if (error != WHISKER_ERROR_RING_MISSING && error != WHISKER_ERROR_WRITER_DEAD) {
            return error;
        }
        const int step = ring_sleep_ms(timeout_ms, started, ATTACH_MS);
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
    reader->waits_since_ms = 0;
    reader->has_sequence = false;
    reader->in_haste = false;
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
