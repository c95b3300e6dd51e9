/*
 * libFuzzer target: any bytes, mixed with frames that are made good, never break the stream's parser: every byte is
 * counted once, a good frame after enough rest is always read, and a second parser fed with the same bytes agrees.
 * Input: which packets; then commands: odd: a good frame of the next values, even: n bytes as they are.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "create/stream.h"

static void demand(int truth)
{
    if (!truth) {
        abort();
    }
}

static size_t choose_ids(uint8_t seed, uint8_t *ids)
{
    size_t count = 1u + seed % 8u;
    for (size_t i = 0; i < count; i++) {
        ids[i] = (uint8_t)(CREATE_OI_PACKET_MIN + (seed + 11u * i) % (CREATE_OI_PACKET_MAX - CREATE_OI_PACKET_MIN + 1));
    }
    return count;
}

/* Makes what the parser expects a frame whose data are `fill`. */
static void make_good(const struct create_stream *stream, uint8_t fill, uint8_t *bytes)
{
    uint8_t sum = 0;
    for (size_t i = 0; i + 1 < stream->length; i++) {
        bytes[i] = stream->known[i] ? stream->expected[i] : fill;
        sum = (uint8_t)(sum + bytes[i]);
    }
    bytes[stream->length - 1] = (uint8_t)-sum;
}

static int feed(struct create_stream *stream, const uint8_t *bytes, size_t count)
{
    struct create_frame frame;
    int frames = 0;
    for (size_t i = 0; i < count; i++) {
        frames += create_stream_push(stream, bytes[i], &frame);
        const struct create_stream_counts *counts = &stream->counts;
        demand(stream->count < stream->length);
        demand(counts->bytes == counts->frames * stream->length + counts->skipped + stream->count);
        demand(counts->resyncs <= counts->corrupt);
    }
    return frames;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct create_stream stream;
    uint8_t ids[8], good[CREATE_STREAM_BYTES];
    if (size == 0 || create_stream_begin(&stream, ids, choose_ids(data[0], ids)) == 0) {
        return 0;
    }
    for (size_t at = 1; at < size;) {
        const uint8_t order = data[at++];
        const size_t wanted = order / 2u, left = size - at, count = wanted < left ? wanted : left;
        if (order & 1) {
            make_good(&stream, order, good);
            feed(&stream, good, stream.length);
        } else {
            feed(&stream, data + at, count);
            at += count;
        }
    }
    /* Whatever came before, it cannot hide more than the frame it may be part of. */
    make_good(&stream, 0, good);
    demand(feed(&stream, good, stream.length) + feed(&stream, good, stream.length) >= 1);
    return 0;
}
