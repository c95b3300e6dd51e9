/* One tick of all lanes, as the host holds it, and the decoders that make it from the bridge's bytes. */
#ifndef WHISKER_FRAME_H
#define WHISKER_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)
/* cffi: begin */
#define WHISKER_FRAME_LANES 28
#define WHISKER_FRAME_LAST 1            /* bit of flags: the last frame after a stop */
#define WHISKER_FRAME_GAP 256           /* bit of flags, set by the host: the first frame after the bridge had gone */
#define WHISKER_FRAME_USB_TIME_SHIFT 16 /* of flags: from this bit on usb_time of the wire, see whisker.toml */
#define WHISKER_STATUS_ERROR_BITS 10    /* of a status, from bit 0: the sensor's errors; above them: the code */

/* What one lane delivered: counts (0x8000 at rest, 65536 counts = 180 degrees); status: 0 good, see whisker.toml. */
struct whisker_sample {
    uint16_t alpha;
    uint16_t beta;
    uint16_t status;
    uint16_t reserved;
};

/*
 * The entry of a ring, 256 bytes. tick counts from start and does not wrap; time_cycles is the bridge's 60 MHz clock,
 * also from start. Both begin anew at a frame with WHISKER_FRAME_GAP.
 */
struct whisker_frame {
    uint64_t tick;
    uint64_t time_cycles;
    uint32_t sequence;
    uint32_t dropped;
    uint32_t lane_mask;
    uint32_t flags;
    struct whisker_sample lane[WHISKER_FRAME_LANES];
};
/* cffi: end */

/*
 * Decodes one frame of the wire format. bytes: the frame's first byte on; count: how many there are (256 are used).
 * Returns 0, or TRUNCATED, MAGIC, WIRE_VERSION, HEADER_CRC, LANES (frame untouched), or RECORD_CRC or RECORD_TICK: the
 * frame is filled in, and each lane whose record is damaged (of another tick) has status code LINK_CRC (LINK_TICK) and
 * zero angles, so the other lanes are kept.
 */
int whisker_frame_decode(const uint8_t *bytes, size_t count, struct whisker_frame *frame);

/* What a decoder has seen. A run of bytes that is no frame counts once, under its first cause. */
struct whisker_decoder_counts {
    uint64_t frames;
    uint64_t frames_damaged;  /* delivered, with at least one lane flagged here */
    uint64_t records_damaged; /* flagged here because of their CRC */
    uint64_t records_slipped; /* flagged here because of their tick */
    uint64_t bytes_skipped;
    uint64_t bad_magic;
    uint64_t bad_wire_version;
    uint64_t bad_header_crc;
    uint64_t bad_lanes;
    uint64_t truncated;
};

/* Finds frames in a stream of bytes cut anywhere. Owned by the caller, no allocation; not for two threads at once. */
struct whisker_decoder {
    struct whisker_decoder_counts counts;
    uint64_t tick;     /* of the last frame, extended to 64 bits */
    size_t held;       /* bytes kept from earlier chunks */
    uint32_t mark;     /* flags for the next frame, such as WHISKER_FRAME_GAP; then 0 */
    bool synchronised; /* false from a bad byte to the next good frame */
    int first_error;   /* why bytes were skipped for the first time; 0: never */
    uint8_t bytes[256];
};

/* Begins a new stream. */
void whisker_decoder_init(struct whisker_decoder *decoder);

/*
 * Takes bytes from *bytes (and *count) until a frame is complete. Returns true and the frame, or false when the chunk
 * is used up; call again until false. The frames do not depend on where the stream is cut.
 */
bool whisker_decoder_next(struct whisker_decoder *decoder, const uint8_t **bytes, size_t *count,
                          struct whisker_frame *frame);

/* Ends the stream: bytes still held are counted as one truncated frame and forgotten. */
void whisker_decoder_end(struct whisker_decoder *decoder);
#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
