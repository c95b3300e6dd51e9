/*
 * Layout of the shared memory, version 2: one page of header, then `capacity` frames of 256 bytes. Little-endian.
 *
 *   offset  size  field
 *        0     8  magic "WHSKRING"; a file that has a name is complete
 *        8     4  layout version
 *       12     4  bytes of the header (a page)
 *       16     4  bytes of a frame (256)
 *       20     4  capacity in frames, a power of two
 *       24     8  generation: nanoseconds since boot when it was made
 *       32     4  process id of the writer, for people
 *       64     8  head: frames published
 *       72     8  state: 1 open, 2 closed
 *       80     4  signal: changes with every publication and with the close; readers wait on it (futex)
 *      128     8  claim: frames below this index are published or being written; never goes back
 *      256    88  clock: version, two copies of struct whisker_clock (ring_cell.h)
 *      512   456  stats: version, two copies of struct whisker_daemon_stats
 *
 * Frame i lies at index i mod capacity. The protocol, and why each fence is where it is: docs/ring.md.
 * Writer: claim >= head + n, release | fence | write n frames | head += n, release | signal, wake.
 * Reader: head, acquire | use frames below it | fence | claim: frame i was intact if claim - i <= capacity.
 * Locks of the file: ring_file.h.
 */
#ifndef WHISKER_RING_LAYOUT_H
#define WHISKER_RING_LAYOUT_H

#include <assert.h>
#include <stddef.h>

#include "ring_cell.h"
#include "whisker/clock.h"
#include "whisker/frame.h"
#include "whisker/stats.h"

#define RING_MAGIC UINT64_C(0x474E49524B534857) /* "WHSKRING" in memory */
#define RING_LAYOUT_VERSION 2u
#define RING_CAPACITY_MIN 64u
#define RING_CAPACITY_MAX (UINT32_C(1) << 20)
/* What no count of frames reaches: a head or a claim above it was not counted. */
#define RING_COUNT_MAX ((uint64_t)INT64_MAX)
/* Claims are made in steps of a capacity's 64th: the line they are in then seldom moves between writer and readers. */
#define RING_CLAIM_PARTS 64u

enum ring_state { RING_OPEN = 1, RING_CLOSED = 2 };

struct ring_header {
    /* Never changes once the ring has its name. */
    ring_word magic;
    uint32_t version;
    uint32_t header_bytes;
    uint32_t frame_bytes;
    uint32_t capacity;
    uint64_t generation;
    uint32_t writer_pid;
    uint8_t pad0[28];
    /* A cache line of its own: what a polling reader looks at. */
    ring_word head;
    ring_word state;
    ring_signal signal;
    uint8_t pad1[44];
    /* A cache line of its own: what a reader looks at when it has used frames. */
    ring_word claim;
    uint8_t pad2[120];
    RING_CELL(struct whisker_clock) clock;
    uint8_t pad3[168];
    RING_CELL(struct whisker_daemon_stats) stats;
};

#define RING_AT(field, offset) static_assert(offsetof(struct ring_header, field) == (offset), "documented layout")
RING_AT(magic, 0);
RING_AT(version, 8);
RING_AT(header_bytes, 12);
RING_AT(frame_bytes, 16);
RING_AT(capacity, 20);
RING_AT(generation, 24);
RING_AT(writer_pid, 32);
RING_AT(head, 64);
RING_AT(state, 72);
RING_AT(signal, 80);
RING_AT(claim, 128);
RING_AT(clock, 256);
RING_AT(stats, 512);
static_assert(sizeof(struct whisker_clock) == 40, "documented layout");
static_assert(sizeof(struct whisker_daemon_stats) <= 256, "documented layout");
static_assert(sizeof(struct whisker_frame) == 256, "documented layout");

#endif
