#include <stdlib.h>
#include <string.h>

#include "ring_internal.h"
#include "ring_time.h"
#include "whisker/errors.h"

/* How often attach looks for a ring that is not there yet. */
#define ATTACH_MS 5

/* Waits for a ring to come up: one that is missing, or whose writer is dead, may be made anew at any time. */
static int ring_attach_find_awaited(const char *name, uid_t named, int timeout_ms, struct ring_found *found)
{
    const int64_t started = timeout_ms > 0 ? ring_now_ms() : 0;
    for (;;) {
        const int error = ring_find(name, named, found);
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

/* The oldest frame that is still whole. A claim that was not counted is no place to begin: peek says what is wrong. */
static uint64_t ring_attach_oldest(const struct ring_map *map)
{
    const uint64_t claim = ring_load_acquire(&map->header->claim);
    return claim > map->capacity && claim <= RING_COUNT_MAX ? claim - map->capacity : 0;
}

static void ring_attach_start_reading(struct whisker_reader *reader)
{
    reader->generation = reader->map.header->generation;
    reader->position = ring_attach_oldest(&reader->map);
    reader->peeked = 0;
    reader->waits_since_ms = 0;
    reader->has_sequence = false;
    reader->in_haste = false;
}

/* Takes what was found in place of what the reader has; on an error that stays. */
static int ring_attach_attach(struct whisker_reader *reader, int timeout_ms)
{
    struct ring_found found;
    struct ring_map map;
    int error = ring_attach_find_awaited(reader->name, reader->named, timeout_ms, &found);
    error = error ? error : ring_map(found.fd, found.capacity, false, &map);
    if (error) {
        return error;
    }
    ring_unmap(&reader->map);
    reader->map = map;
    reader->owner = found.file.st_uid;
    ring_attach_start_reading(reader);
    return WHISKER_OK;
}

int whisker_reader_attach_owned(const char *name, uint32_t owner, int timeout_ms, struct whisker_reader **reader)
{
    *reader = NULL;
    char path[RING_PATH_BYTES];
    int error = ring_path(name, RING_PLACE_SHARED, path);
    if (error) {
        return error;
    }
    struct whisker_reader *made = calloc(1, sizeof *made);
    if (!made) {
        return WHISKER_ERROR_MEMORY;
    }
    strcpy(made->name, name); /* ring_path has measured it */
    made->named = owner;
    error = ring_attach_attach(made, timeout_ms);
    if (error) {
        free(made);
        return error;
    }
    *reader = made;
    return WHISKER_OK;
}

int whisker_reader_attach(const char *name, int timeout_ms, struct whisker_reader **reader)
{
    return whisker_reader_attach_owned(name, WHISKER_RING_NO_OWNER, timeout_ms, reader);
}

int whisker_reader_reattach(struct whisker_reader *reader, int timeout_ms)
{
    return ring_attach_attach(reader, timeout_ms);
}

void whisker_reader_detach(struct whisker_reader *reader)
{
    if (reader) {
        ring_unmap(&reader->map);
        free(reader);
    }
}
