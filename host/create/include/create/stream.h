/*
 * The base's sensor stream: bytes in, one at a time, frames out.
 *
 * A frame is [19][n][id data]...[sum] (protocol/create_oi.h). Since the driver has asked for certain packets, every
 * byte of a frame but its data is known beforehand: another length, packet or order is a corrupt frame, whatever its
 * sum. After lost, extra or corrupt bytes no byte is thrown away that could belong to a whole frame, so exactly the
 * frames that were damaged are lost. Pure: no allocation, no I/O.
 */
#ifndef CREATE_STREAM_H
#define CREATE_STREAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "create_oi.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

#define CREATE_STREAM_BYTES 256 /* more than the longest frame */

/* How a frame fits the clock. The stream says CREATE_IN_TIME; a caller that has a clock sets it. */
enum create_timing {
    CREATE_IN_TIME,
    CREATE_LATE,   /* it was counted as missed before */
    CREATE_SURPLUS /* there is no time that it could be of: said twice, or made up */
};

/* What a base does in some time if it hears each order at once: its motion, and the way, whatever the direction. */
struct create_ordered {
    bool changed;                      /* other speeds were ordered meanwhile */
    bool heard;                        /* the base says that it was asked for the last of them */
    double distance, angle, way, turn; /* m, rad */
};

/* The newest values of the packets asked for, by packet id; the others are 0. Units: protocol/create_oi.h. */
struct create_frame {
    int32_t value[CREATE_OI_PACKET_MAX + 1];
    enum create_timing timing;
    uint32_t missed; /* frames that should have come since the one before, judged by the bytes skipped; a caller that
                        has a clock judges anew */
    struct create_ordered ordered; /* since the frame before; a caller that orders speeds sets it */
    bool unheard; /* the base was not heard for so long before that it may have been started anew; a caller sets it */
};

struct create_stream_counts {
    uint64_t bytes;   /* taken in: of frames, skipped, or held */
    uint64_t frames;  /* whole ones */
    uint64_t corrupt; /* frames expected or begun that were not whole */
    uint64_t skipped; /* bytes that belong to no whole frame */
    uint64_t resyncs; /* times that whole frames came again after bytes were skipped */
};

struct create_stream {
    struct create_stream_counts counts;
    uint8_t expected[CREATE_STREAM_BYTES]; /* of each byte of a frame, where it is known */
    bool known[CREATE_STREAM_BYTES];
    uint8_t held[CREATE_STREAM_BYTES]; /* what may be the beginning of a frame */
    size_t length;                     /* of a frame */
    size_t count;                      /* bytes held */
    uint64_t skipped_before;           /* counts.skipped at the newest whole frame */
    bool synchronised, seen;
};

/* Bytes of a packet's data; 0: there is no such packet. */
size_t create_packet_bytes(unsigned id);

/* A packet's value out of its data. */
int32_t create_packet_value(unsigned id, const uint8_t *data);

/* Begins anew, with counts of 0: frames of these packets, in this order. Returns the length of a frame in bytes, or 0
 * if a packet is unknown or the frame would exceed CREATE_STREAM_BYTES. */
size_t create_stream_begin(struct create_stream *stream, const uint8_t *ids, size_t count);

/* Takes one byte. True: it ended a whole frame, written to *frame. */
bool create_stream_push(struct create_stream *stream, uint8_t byte, struct create_frame *frame);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
