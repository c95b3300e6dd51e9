#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "futex.h"
#include "ring_internal.h"
#include "whisker/errors.h"

static int64_t ring_reader_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* How long to sleep now: at most `step`, at most what is left of the timeout (negative: no limit); 0 when that is over.
 */
static int ring_reader_sleep_ms(int timeout_ms, int64_t started_ms, int step)
{
    if (timeout_ms < 0) {
        return step;
    }
    const int64_t left = timeout_ms - (ring_reader_now_ms() - started_ms);
    return left <= 0 ? 0 : left < step ? (int)left : step;
}

/* How often attach looks for a ring that is not there yet. */
#define ATTACH_MS 5

/* Waits for a ring to come up: one that is missing, or whose writer is dead, may be made anew at any time. */
static int ring_attach_find_awaited(const char *name, uid_t named, int timeout_ms, struct ring_found *found)
{
    const int64_t started = timeout_ms > 0 ? ring_reader_now_ms() : 0;
    for (;;) {
        const int error = ring_find(name, named, found);
        if (error != WHISKER_ERROR_RING_MISSING && error != WHISKER_ERROR_WRITER_DEAD) {
            return error;
        }
        const int step = ring_reader_sleep_ms(timeout_ms, started, ATTACH_MS);
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

/* Whether the frame of this index may have been overwritten. Not believing the shared numbers costs nothing. */
static bool ring_reader_is_overwritten(const struct whisker_reader *reader, uint64_t index)
{
    ring_fence_after_reading();
    return ring_load(&reader->map.header->claim) - index > reader->map.capacity;
}

/* Where the frame of this index lies; up to a capacity of frames lie there in a row. */
static const struct whisker_frame *ring_reader_place(const struct whisker_reader *reader, uint64_t index)
{
    return &reader->map.frames[index & (reader->map.capacity - 1)];
}

/* Half a ring behind the writer, so that the next overrun is not at once. A writer that has overtaken this reader is
 * further than that: a head that is not, or that went back, was not counted, and nothing is to be had of such a ring.
 */
static int ring_reader_skip_lost(struct whisker_reader *reader)
{
    ring_fence_after_reading(); /* the head is not older than the claim that showed the overrun */
    const uint64_t ahead = ring_load_acquire(&reader->map.header->head) - reader->position;
    const uint64_t half = reader->map.capacity / 2;
    reader->peeked = 0;
    if (ahead > RING_COUNT_MAX || ahead <= half) {
        return WHISKER_ERROR_RING_LOST;
    }
    reader->frames_overrun += ahead - half;
    reader->position += ahead - half;
    reader->overruns++;
    reader->has_sequence = false;
    return WHISKER_ERROR_OVERRUN;
}

int whisker_reader_peek(struct whisker_reader *reader, const struct whisker_frame **frames, size_t *count)
{
    const uint64_t head = ring_load_acquire(&reader->map.header->head);
    *frames = ring_reader_place(reader, reader->position);
    *count = 0;
    if (!ring_is_whole(&reader->map)) {
        return WHISKER_ERROR_RING_LOST;
    }
    if (head - reader->position > reader->map.capacity) {
        return ring_reader_skip_lost(reader);
    }
    reader->peeked = head - reader->position;
    *count = reader->peeked;
    return WHISKER_OK;
}

/* Differences modulo 2^32, for the sequence number wraps. Less than nothing missing is a bridge that restarted. */
static void ring_reader_count_missing(struct whisker_reader *reader, uint32_t first, uint32_t last, size_t count)
{
    const uint32_t before = reader->has_sequence ? reader->sequence : first - 1;
    const uint32_t missing = last - before - (uint32_t)count;
    if (missing != 0 && missing < UINT32_MAX / 2) {
        reader->frames_missing += missing;
    }
    reader->sequence = last;
    reader->has_sequence = true;
}

int whisker_reader_advance(struct whisker_reader *reader, size_t count)
{
    if (count > reader->peeked) {
        return WHISKER_ERROR_ARGUMENT;
    }
    if (count == 0) {
        return WHISKER_OK;
    }
    const uint32_t last = ring_reader_place(reader, reader->position + count - 1)->sequence;
    const uint32_t first = ring_reader_place(reader, reader->position)->sequence;
    const bool overwritten = ring_reader_is_overwritten(reader, reader->position);
    if (!ring_is_whole(&reader->map)) {
        return WHISKER_ERROR_RING_LOST;
    }
    if (overwritten) {
        return ring_reader_skip_lost(reader);
    }
    ring_reader_count_missing(reader, first, last, count);
    reader->position += count;
    reader->peeked -= count;
    return WHISKER_OK;
}

int whisker_reader_window(struct whisker_reader *reader, size_t count, const struct whisker_frame **frames)
{
    *frames = reader->map.frames;
    if (count > reader->map.capacity) {
        return WHISKER_ERROR_ARGUMENT;
    }
    const uint64_t head = ring_load_acquire(&reader->map.header->head);
    if (!ring_is_whole(&reader->map) || head > RING_COUNT_MAX) {
        return WHISKER_ERROR_RING_LOST;
    }
    const size_t given = head < count ? (size_t)head : count;
    reader->window = head - given;
    *frames = ring_reader_place(reader, reader->window);
    return (int)given;
}

int whisker_reader_intact(const struct whisker_reader *reader)
{
    const bool overwritten = ring_reader_is_overwritten(reader, reader->window);
    if (!ring_is_whole(&reader->map)) {
        return WHISKER_ERROR_RING_LOST;
    }
    return overwritten ? WHISKER_ERROR_OVERRUN : WHISKER_OK;
}

void whisker_reader_seek_latest(struct whisker_reader *reader, size_t count)
{
    const uint64_t head = ring_load_acquire(&reader->map.header->head);
    if (head > count && head <= RING_COUNT_MAX && head - count > reader->position) {
        reader->position = head - count;
        reader->has_sequence = false;
    }
    reader->peeked = 0;
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
        .owner = reader->owner,
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

/* A dead writer wakes nobody, so a waiting reader looks for itself this often. */
#define LIVENESS_MS 100
/* A writer asks once per tick of its clock (10 ms at most) whether readers wait; until it has surely asked since this
 * reader began to, the reader looks for itself. */
#define UNHEARD_MS 30
#define UNHEARD_STEP_MS 1
/* Looks that a reader in haste makes before it sleeps: a few microseconds, less than falling asleep and being woken. */
#define LOOKS 100

/* 0: there is something to peek; TIMEOUT: not yet; CLOSED, RING_LOST: never again. The state is read before the head,
 * so frames published before the close are not missed. */
static int ring_wait_look(const struct whisker_reader *reader)
{
    const uint64_t state = ring_load_acquire(&reader->map.header->state);
    const uint64_t head = ring_load_acquire(&reader->map.header->head);
    if (!ring_is_whole(&reader->map) || head - reader->position > RING_COUNT_MAX) {
        return WHISKER_ERROR_RING_LOST; /* a head behind what was read, or beyond any count */
    }
    if (head != reader->position) {
        return WHISKER_OK;
    }
    return state == RING_CLOSED ? WHISKER_ERROR_CLOSED : WHISKER_ERROR_TIMEOUT;
}

/* Looks, and checks the writer's life: when it is over, what it published last is seen by looking once more. */
static int ring_wait_look_closely(const struct whisker_reader *reader)
{
    int seen = ring_wait_look(reader);
    if (seen == WHISKER_ERROR_TIMEOUT && !ring_file_is_locked(reader->map.fd, RING_LOCK_WRITER)) {
        seen = ring_wait_look(reader);
        seen = seen == WHISKER_ERROR_TIMEOUT ? WHISKER_ERROR_WRITER_DEAD : seen;
    }
    return seen;
}

/* An ended ring: does its name belong to a new one? */
static int ring_wait_ended(const struct whisker_reader *reader, int error)
{
    struct ring_found other;
    struct stat mine;
    if (ring_find(reader->name, reader->named, &other) != WHISKER_OK) {
        return error;
    }
    close(other.fd);
    const bool is_mine = fstat(reader->map.fd, &mine) == 0 && ring_file_is_same(&mine, &other.file);
    return is_mine ? error : WHISKER_ERROR_RESTARTED;
}

/* Lets the writer know, by a lock that ends with this process, that there is someone to wake. */
static int ring_wait_longest_sleep_ms(struct whisker_reader *reader)
{
    const int64_t now = ring_reader_now_ms();
    if (reader->waits_since_ms == 0 && ring_file_lock(reader->map.fd, RING_LOCK_WAITING)) {
        reader->waits_since_ms = now;
    }
    const bool heard = reader->waits_since_ms != 0 && now - reader->waits_since_ms > UNHEARD_MS;
    return heard ? LIVENESS_MS : UNHEARD_STEP_MS;
}

/* While frames come faster than a reader can sleep between them it looks on for a moment. It is in haste as long as
 * that finds something: a reader of a slow stream never looks in vain. */
static void ring_wait_look_on(struct whisker_reader *reader)
{
    int looks = reader->in_haste ? LOOKS : 1;
    while (looks > 0 && ring_wait_look(reader) == WHISKER_ERROR_TIMEOUT) {
        ring_pause();
        looks--;
    }
    reader->in_haste = looks > 0;
}

int whisker_reader_wait(struct whisker_reader *reader, int timeout_ms)
{
    const int64_t started = timeout_ms > 0 ? ring_reader_now_ms() : 0;
    if (timeout_ms != 0) {
        ring_wait_look_on(reader);
    }
    for (;;) {
        const uint32_t signal = ring_signal_load(&reader->map.header->signal);
        const int seen = ring_wait_look_closely(reader);
        if (seen == WHISKER_OK) {
            return WHISKER_OK;
        }
        if (seen != WHISKER_ERROR_TIMEOUT) {
            return ring_wait_ended(reader, seen);
        }
        const int step =
            timeout_ms == 0 ? 0 : ring_reader_sleep_ms(timeout_ms, started, ring_wait_longest_sleep_ms(reader));
        if (step == 0) {
            return WHISKER_ERROR_TIMEOUT;
        }
        futex_wait(&reader->map.header->signal, signal, step);
    }
}
