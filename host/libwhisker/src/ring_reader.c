#include "ring_internal.h"
#include "whisker/errors.h"

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
