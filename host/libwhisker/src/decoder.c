#include <assert.h>
#include <string.h>

#include "frame_header.h"
#include "whisker/errors.h"
#include "whisker/frame.h"
#include "whisker_protocol.h"

static_assert(sizeof((struct whisker_decoder *)0)->bytes == WHISKER_FRAME_BYTES, "a decoder holds at most one frame");

void whisker_decoder_init(struct whisker_decoder *decoder)
{
    memset(decoder, 0, sizeof *decoder);
    decoder->synchronised = true;
}

static void decoder_count_error(struct whisker_decoder_counts *counts, int error)
{
    switch (error) {
    case WHISKER_ERROR_MAGIC:
        counts->bad_magic++;
        break;
    case WHISKER_ERROR_WIRE_VERSION:
        counts->bad_wire_version++;
        break;
    case WHISKER_ERROR_HEADER_CRC:
        counts->bad_header_crc++;
        break;
    case WHISKER_ERROR_TRUNCATED:
        counts->truncated++;
        break;
    default:
        counts->bad_lanes++;
    }
}

/* The wire's tick wraps after 24 days. A step back of more than half the range is a wrap, any other is a new start. */
static uint64_t decoder_extend_tick(uint64_t last, uint32_t tick)
{
    const uint32_t last_low = (uint32_t)last;
    if (tick >= last_low) {
        return last - last_low + tick;
    }
    return last_low - tick > UINT32_MAX / 2 ? last - last_low + tick + UINT32_MAX + 1 : tick;
}

/* Where the next frame could begin after `from`, or the end of the window. */
static size_t decoder_next_candidate(const uint8_t *bytes, size_t from)
{
    const uint8_t *found = memchr(bytes + from, WHISKER_LIMIT_FRAME_MAGIC & 0xFFu, WHISKER_FRAME_BYTES - from);
    return found ? (size_t)(found - bytes) : WHISKER_FRAME_BYTES;
}

/* Damaged records may also be the next frame, when this one lost bytes. A header inside it shows it; 0: there is none.
 */
static size_t decoder_frame_inside(const uint8_t *bytes)
{
    size_t at = decoder_next_candidate(bytes, 1);
    while (at <= WHISKER_FRAME_BYTES - WHISKER_FRAME_HEADER_BYTES) {
        if (frame_check_header(bytes + at) == WHISKER_OK) {
            return at;
        }
        at = decoder_next_candidate(bytes, at + 1);
    }
    return 0;
}

static size_t decoder_skip(struct whisker_decoder *decoder, int error, size_t bytes)
{
    if (decoder->synchronised) {
        decoder_count_error(&decoder->counts, error);
        decoder->synchronised = false;
        decoder->first_error = decoder->first_error ? decoder->first_error : error;
    }
    decoder->counts.bytes_skipped += bytes;
    return bytes;
}

/* Decodes the frame at bytes and returns how many bytes to leave behind: all of it, or those up to a possible start. */
static size_t decoder_take(struct whisker_decoder *decoder, const uint8_t *bytes, struct whisker_frame *frame,
                           bool *made)
{
    struct frame_damage damage;
    const int error = frame_decode(bytes, frame, &damage);
    if (error && error != WHISKER_ERROR_RECORD_CRC && error != WHISKER_ERROR_RECORD_TICK) {
        return decoder_skip(decoder, error, decoder_next_candidate(bytes, 1));
    }
    const size_t inside = error ? decoder_frame_inside(bytes) : 0;
    if (inside) {
        return decoder_skip(decoder, WHISKER_ERROR_TRUNCATED, inside);
    }
    *made = true;
    decoder->synchronised = true;
    decoder->counts.frames++;
    decoder->counts.frames_damaged += error != WHISKER_OK;
    decoder->counts.records_damaged += damage.damaged;
    decoder->counts.records_slipped += damage.slipped;
    frame->flags |= decoder->mark;
    decoder->mark = 0;
    frame->tick = decoder->tick = decoder_extend_tick(decoder->tick, (uint32_t)frame->tick);
    return WHISKER_FRAME_BYTES;
}

static void decoder_fill(struct whisker_decoder *decoder, const uint8_t **bytes, size_t *count)
{
    const size_t room = WHISKER_FRAME_BYTES - decoder->held;
    const size_t taken = *count < room ? *count : room;
    memcpy(decoder->bytes + decoder->held, *bytes, taken);
    decoder->held += taken;
    *bytes += taken;
    *count -= taken;
}

bool whisker_decoder_next(struct whisker_decoder *decoder, const uint8_t **bytes, size_t *count,
                          struct whisker_frame *frame)
{
    bool made = false;
    while (!made && decoder->held + *count >= WHISKER_FRAME_BYTES) {
        if (decoder->held == 0) { /* whole frames in the chunk are decoded where they are */
            const size_t used = decoder_take(decoder, *bytes, frame, &made);
            *bytes += used;
            *count -= used;
            continue;
        }
        decoder_fill(decoder, bytes, count);
        const size_t used = decoder_take(decoder, decoder->bytes, frame, &made);
        decoder->held -= used;
        memmove(decoder->bytes, decoder->bytes + used, decoder->held);
    }
    if (!made && *count > 0) {
        decoder_fill(decoder, bytes, count);
    }
    return made;
}

void whisker_decoder_end(struct whisker_decoder *decoder)
{
    decoder->counts.truncated += decoder->held > 0;
    decoder->held = 0;
}
