#include <unistd.h>

#include "futex.h"
#include "ring_internal.h"
#include "ring_time.h"
#include "whisker/errors.h"

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

/* As look, with the writer's life: when it is over, what it published last is seen by looking once more. */
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
    const int64_t now = ring_now_ms();
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
    const int64_t started = timeout_ms > 0 ? ring_now_ms() : 0;
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
        const int step = timeout_ms == 0 ? 0 : ring_sleep_ms(timeout_ms, started, ring_wait_longest_sleep_ms(reader));
        if (step == 0) {
            return WHISKER_ERROR_TIMEOUT;
        }
        futex_wait(&reader->map.header->signal, signal, step);
    }
}
