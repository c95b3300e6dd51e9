/*
 * The ring: the last frames in POSIX shared memory. One process writes, any number read; a reader maps it read-only, so
 * it can neither block nor corrupt it, and may be killed at any instruction. The memory is mapped twice in a row, so
 * any window of frames is one array. Frames are used where they lie: peek, use, advance; advance reports whether the
 * writer overtook the reader meanwhile, in which case what was used must be thrown away.
 *
 * Places and trust: the service's ring lies in a directory that only the service can write, every other ring where any
 * user can make one; readers look in this order. A reader accepts a ring of root, of its own user, of the service's,
 * and of the user that it is asked to accept; another user's is refused unread.
 *
 * Memory: a ring's owner can make its file shorter under everybody's feet. That ends no process: from the first attach
 * or create on, SIGBUS over a ring's memory is handled here (every other SIGBUS goes where it went before), the memory
 * reads as zeros, and the next call says RING_LOST.
 *
 * Threads: one handle belongs to one thread at a time; different handles, and functions without one, may be used by
 * different threads at once. Errors: 0 or a negative code of errors.h.
 */
#ifndef WHISKER_RING_H
#define WHISKER_RING_H

#include <stddef.h>
#include <stdint.h>

#include "whisker/clock.h"
#include "whisker/frame.h"
#include "whisker/stats.h"

#define WHISKER_RING_SERVICE_DIRECTORY "/run/whiskerd" /* the RuntimeDirectory of whiskerd's unit */
#define WHISKER_RING_SERVICE_USER "whisker"            /* its user; without such a user there is no service to trust */
#define WHISKER_RING_DIRECTORY "/dev/shm"              /* everybody else's */

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)
/* cffi: begin */
#define WHISKER_RING_NO_OWNER 4294967295U /* as a user id: nobody's */
#define WHISKER_RING_FRAMES 8192          /* 4 s at 2 kHz; the default capacity */

struct whisker_reader;

/* What a reader knows of its ring and of itself. */
struct whisker_reader_info {
    uint64_t generation;     /* another number for each ring ever made under a name on this machine since it started */
    uint64_t published;      /* frames the writer has published */
    uint64_t position;       /* index of the frame that peek gives first */
    uint64_t overruns;       /* how often the writer overtook this reader */
    uint64_t frames_overrun; /* frames this reader lost by it */
    uint64_t frames_missing; /* sequence numbers missing between frames of the ring: lost before it */
    uint32_t capacity;       /* frames */
    uint32_t writer_pid;     /* as the writer says */
    uint32_t owner;          /* user id: whose ring it is */
};

/*
 * Attaches to the ring `name` ("whisker", no slash), at its oldest frame. Waits up to timeout_ms for the ring to come
 * up (0: no waiting, negative: for ever). Returns 0 and the reader, or RING_NAME, RING_MISSING, RING_LAYOUT,
 * RING_VERSION, RING_OWNER (of a user who is not accepted), RING_ACCESS (unreadable), WRITER_DEAD (a ring is there, its
 * writer is not), SYSTEM, MEMORY; then *reader is NULL. Waits for no ring of another user's.
 */
int whisker_reader_attach(const char *name, int timeout_ms, struct whisker_reader **reader);

/* Does what whisker_reader_attach does, and accepts rings of the user `owner`, too. WHISKER_RING_NO_OWNER: no other
 * user's. */
int whisker_reader_attach_owned(const char *name, uint32_t owner, int timeout_ms, struct whisker_reader **reader);

/* Lets go of the ring; NULL is allowed. */
void whisker_reader_detach(struct whisker_reader *reader);

/*
 * Waits until there is a frame to peek (0: just looks, negative: for ever). Returns 0, TIMEOUT, or, when every frame
 * has been read: CLOSED, WRITER_DEAD, RESTARTED (a new ring has the name: see whisker_reader_reattach); RING_LOST.
 */
int whisker_reader_wait(struct whisker_reader *reader, int timeout_ms);

/*
 * Gives all frames published and not yet read, oldest first, as one array inside the ring; count may be 0. Never waits.
 * Returns 0; OVERRUN: frames were lost; the reader now stands half a ring behind the writer, peek again; RING_LOST.
 */
int whisker_reader_peek(struct whisker_reader *reader, const struct whisker_frame **frames, size_t *count);

/*
 * Leaves the first `count` of the frames peeked behind. Returns 0: they were intact up to this call; OVERRUN: they may
 * have been overwritten while they were used (position as for peek); RING_LOST; ARGUMENT: more than was peeked.
 */
int whisker_reader_advance(struct whisker_reader *reader, size_t count);

/*
 * Gives the newest `count` frames, oldest first, as one array inside the ring, wherever the reader stands; its position
 * stays. Use them, then ask whisker_reader_intact. Returns how many: fewer when the ring has not had so many; or
 * ARGUMENT: more than the capacity, RING_LOST. Never waits.
 */
int whisker_reader_window(struct whisker_reader *reader, size_t count, const struct whisker_frame **frames);

/* Whether the last window was whole up to this call: 0; OVERRUN: what was used of it must be thrown away; RING_LOST. */
int whisker_reader_intact(const struct whisker_reader *reader);

/* Goes to where at most the newest `count` frames are still to be read. Never goes back. Not counted as a loss. */
void whisker_reader_seek_latest(struct whisker_reader *reader, size_t count);

/* Lets go of an ended ring and attaches to the new one of its name, as whisker_reader_attach; counters stay. */
int whisker_reader_reattach(struct whisker_reader *reader, int timeout_ms);

/* Fills in *info. */
void whisker_reader_info(const struct whisker_reader *reader, struct whisker_reader_info *info);

/* The latest mapping of the bridge's clock; ns_per_cycle is 0 before the first. Returns 0, or TIMEOUT: never still. */
int whisker_reader_clock(const struct whisker_reader *reader, struct whisker_clock *clock);

/* What the daemon last published of itself; all zeros before the first time. Returns 0, or TIMEOUT: never still. */
int whisker_reader_stats(const struct whisker_reader *reader, struct whisker_daemon_stats *stats);

#define WHISKER_RING_NAME_BYTES 208
#define WHISKER_RING_PATH_BYTES 512
#define WHISKER_RING_LINE_BYTES 1536

/* A ring found on this machine. */
struct whisker_ring_entry {
    char name[WHISKER_RING_NAME_BYTES];
    char path[WHISKER_RING_PATH_BYTES];
    uint64_t bytes;
    uint64_t published;  /* frames; 0 as the rest below when it has another version */
    uint64_t generation; /* as in struct whisker_reader_info */
    uint32_t capacity;   /* frames */
    uint32_t writer_pid;
    uint32_t owner;   /* user id */
    uint32_t version; /* of its layout */
    int error;        /* 0: a reader can attach; WRITER_DEAD: left by a killed writer; else as whisker_reader_attach */
};

/* Finds all rings, those of the service first, else in no order. Fills in at most `room` entries; returns how many
 * there are, or SYSTEM. */
int whisker_ring_list(struct whisker_ring_entry *entries, size_t room);

/*
 * Says in one line what an error about the ring `name` means here and now: "text; remedy" of errors.h, with the file it
 * is about, whose that is, and what to do about a file that another user left there. `room` bytes of `line` are enough
 * if they are WHISKER_RING_LINE_BYTES; a longer line is cut.
 */
void whisker_ring_explain(const char *name, int error, char *line, size_t room);

/*
 * Sends a signal to the writer of the ring `name` that a reader would attach to. The ring only says which process its
 * writer is; that process gets the signal only if it holds the writer's lock on this very file. Returns 0, or
 * RING_NAME, RING_MISSING, RING_OWNER, RING_LAYOUT, RING_VERSION, WRITER_DEAD, RING_WRITER (no such process here),
 * RING_ACCESS (it is another user's), SYSTEM.
 */
int whisker_ring_signal_writer(const char *name, int number);

/* Reads the newest text of whisker_ring_set_nodes for the ring `name` into `text`, cut where `room` bytes end, and when
 * it was written (CLOCK_REALTIME). owner: as whisker_reader_attach_owned. Returns 0, or RING_MISSING (no text),
 * RING_NAME, RING_OWNER, RING_LAYOUT, RING_ACCESS, SYSTEM, ARGUMENT (no room). */
int whisker_ring_nodes(const char *name, uint32_t owner, char *text, size_t room, int64_t *written_ns);

struct whisker_ring;

/*
 * Makes the ring `name` of `capacity` frames (a power of two, 64 to 2^20) and becomes its writer. A ring whose writer
 * died is replaced; its readers learn RESTARTED. Returns 0 and the ring, or ARGUMENT, RING_NAME, RING_BUSY (another
 * writer lives, be it in the service's directory, where readers look first), RING_LAYOUT (the name is that of something
 * else), RING_ACCESS (another user's), SYSTEM, MEMORY; then *ring is NULL.
 */
int whisker_ring_create(const char *name, uint32_t capacity, struct whisker_ring **ring);

/* As whisker_ring_create, but in this directory: WHISKER_RING_SERVICE_DIRECTORY or WHISKER_RING_DIRECTORY, else
 * ARGUMENT.
 */
int whisker_ring_create_in(const char *directory, const char *name, uint32_t capacity, struct whisker_ring **ring);

/* Copies `count` frames (at most a quarter of the capacity) into the ring and wakes waiting readers once. Never waits.
 * Returns 0, ARGUMENT, or RING_LOST (make a new ring). */
int whisker_ring_publish(struct whisker_ring *ring, const struct whisker_frame *frames, size_t count);

/* Tell the readers the clock mapping and the daemon's statistics; a few times a second is enough. Never waits. */
void whisker_ring_set_clock(struct whisker_ring *ring, const struct whisker_clock *clock);
void whisker_ring_set_stats(struct whisker_ring *ring, const struct whisker_daemon_stats *stats);

/* Puts a text, what the nodes answered, in the place of the one before, for whisker_ring_nodes; it goes when the ring
 * is closed. Returns 0, RING_ACCESS (another user's file is in the way), SYSTEM. */
int whisker_ring_set_nodes(struct whisker_ring *ring, const char *text);

/* Removes the name, lets the readers know that the stream has ended, and lets go; what they hold they can finish
 * reading. NULL is allowed. */
void whisker_ring_close(struct whisker_ring *ring);
/* cffi: end */

/*
 * Decodes `count` bytes of the bridge's stream straight into the ring, as whisker_ring_publish. frames: if not NULL,
 * gets the frames just published (valid until the next call), made their number.
 * Returns 0, RING_LOST, or ARGUMENT when the bytes could hold more than a quarter of the capacity.
 */
int whisker_ring_feed(struct whisker_ring *ring, struct whisker_decoder *decoder, const uint8_t *bytes, size_t count,
                      const struct whisker_frame **frames, size_t *made);
#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
