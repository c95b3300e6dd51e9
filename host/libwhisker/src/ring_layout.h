/*
 * Layout of the shared memory, version 1: one page of header, then `capacity` frames of 256 bytes.
 *
 *   offset  size  field
 *        0     8  magic "WHSKRING"; stored last, so a ring that is being made is not a ring yet
 *        8     4  layout version
 *       12     4  bytes of the header (a page)
 *       16     4  bytes of a frame (256)
 *       20     4  capacity in frames, a power of two
 *       24     8  generation: nanoseconds since boot when it was made
 *       32     4  process id of the writer, for people
 *       64     8  head: frames published
 *       72     8  claim: frames below this index are published or being written; never goes back
 *       80     8  state: 1 open, 2 closed
 *       88     4  signal: changes with every publication and with the close; readers wait on it (futex)
 *
 * Frame i lies at index i mod capacity.
 * Writer: claim = head + n | fence | write n frames | head += n, release | signal, wake.
 * Reader: head, acquire | use frames below it | fence | claim: frame i was intact if claim - i <= capacity.
 * The writer holds an open-file-description lock on byte 0 while it lives: that, not the process id, says that it does.
 */
#ifndef WHISKER_RING_LAYOUT_H
#define WHISKER_RING_LAYOUT_H

#include <assert.h>
#include <stddef.h>

#include "ring_atomic.h"
#include "whisker/frame.h"

#define RING_MAGIC UINT64_C(0x474E49524B534857) /* "WHSKRING" in memory */
#define RING_LAYOUT_VERSION 1u
#define RING_CAPACITY_MIN 64u
#define RING_CAPACITY_MAX (UINT32_C(1) << 20)

enum ring_state { RING_OPEN = 1, RING_CLOSED = 2 };

struct ring_header {
    ring_word magic;
    uint32_t version;
    uint32_t header_bytes;
    uint32_t frame_bytes;
    uint32_t capacity;
    uint64_t generation;
    uint32_t writer_pid;
    uint8_t pad[28];
    ring_word head; /* a cache line of its own: it changes with every frame, what is above never does */
    ring_word claim;
    ring_word state;
    ring_signal signal;
};

static_assert(offsetof(struct ring_header, head) == 64, "documented layout");
static_assert(offsetof(struct ring_header, signal) == 88, "documented layout");

#endif
