#include "create/stream.h"

#include <string.h>

enum { AT_HEADER, AT_LENGTH, AT_PACKETS };

static const struct {
    uint8_t bytes;
    bool is_signed;
} packets[CREATE_OI_PACKET_MAX + 1] = {
#define PACKET(id, name, size, sign, unit, versions) [id] = {.bytes = size, .is_signed = sign},
    CREATE_OI_PACKETS(PACKET)
#undef PACKET
};

size_t create_packet_bytes(unsigned id)
{
    return id <= CREATE_OI_PACKET_MAX ? packets[id].bytes : 0;
}

int32_t create_packet_value(unsigned id, const uint8_t *data)
{
    if (packets[id].bytes == 1) {
        return packets[id].is_signed ? (int8_t)data[0] : data[0];
    }
    const uint16_t word = (uint16_t)(data[0] << 8 | data[1]);
    return packets[id].is_signed ? (int16_t)word : word;
}

static void stream_expect(struct create_stream *stream, size_t at, size_t byte)
{
    stream->expected[at] = (uint8_t)byte;
    stream->known[at] = true;
}

size_t create_stream_begin(struct create_stream *stream, const uint8_t *ids, size_t count)
{
    memset(stream, 0, sizeof *stream);
    size_t at = AT_PACKETS;
    for (size_t i = 0; i < count; i++) {
        const size_t bytes = create_packet_bytes(ids[i]);
        if (bytes == 0 || at + 1 + bytes >= CREATE_STREAM_BYTES) {
            return 0;
        }
        stream_expect(stream, at, ids[i]);
        at += 1 + bytes;
    }
    stream_expect(stream, AT_HEADER, CREATE_OI_STREAM_HEADER);
    stream_expect(stream, AT_LENGTH, at - AT_PACKETS);
    stream->length = at + 1;
    return stream->length;
}

static bool stream_sum_is_right(const struct create_stream *stream)
{
    uint8_t sum = 0;
    for (size_t i = 0; i < stream->length; i++) {
        sum = (uint8_t)(sum + stream->held[i]);
    }
    return sum == 0;
}

/* Whether the bytes from `from` on, as far as they have come, can be a frame. */
static bool stream_plausible(const struct create_stream *stream, size_t from)
{
    for (size_t i = from; i < stream->count; i++) {
        if (stream->known[i - from] && stream->held[i] != stream->expected[i - from]) {
            return false;
        }
    }
    return true;
}

/* The bytes held are no frame: leaves behind those up to the next that may begin one. */
static void stream_skip(struct create_stream *stream)
{
    const bool begun = stream->count > AT_PACKETS; /* the byte that did not fit came after header and length */
    stream->counts.corrupt += stream->synchronised || begun;
    stream->synchronised = false;
    size_t from = 1;
    while (!stream_plausible(stream, from)) {
        from++;
    }
    stream->counts.skipped += from;
    stream->count -= from;
    memmove(stream->held, stream->held + from, stream->count);
}

static void stream_read_packets(const struct create_stream *stream, struct create_frame *frame)
{
    memset(frame, 0, sizeof *frame);
    for (size_t at = AT_PACKETS; at + 1 < stream->length; at += 1 + create_packet_bytes(stream->held[at])) {
        const uint8_t id = stream->held[at];
        frame->value[id] = create_packet_value(id, &stream->held[at + 1]);
    }
}

static void stream_take(struct create_stream *stream, struct create_frame *frame)
{
    const uint64_t lost = stream->counts.skipped - stream->skipped_before;
    stream_read_packets(stream, frame);
    frame->missed = stream->seen ? (uint32_t)((lost + stream->length / 2) / stream->length) : 0;
    stream->counts.frames++;
    stream->counts.resyncs += stream->seen && !stream->synchronised;
    stream->skipped_before = stream->counts.skipped;
    stream->synchronised = stream->seen = true;
    stream->count = 0;
}

bool create_stream_push(struct create_stream *stream, uint8_t byte, struct create_frame *frame)
{
    const size_t at = stream->count++;
    stream->counts.bytes++;
    stream->held[at] = byte;
    if (stream->known[at] && byte != stream->expected[at]) {
        stream_skip(stream);
        return false;
    }
    if (stream->count < stream->length) {
        return false;
    }
    if (!stream_sum_is_right(stream)) {
        stream_skip(stream);
        return false;
    }
    stream_take(stream, frame);
    return true;
}
