/* From bridge to ring: frames, clock mapping, statistics, and what is due beside them. */
#ifndef WHISKER_DAEMON_STREAM_H
#define WHISKER_DAEMON_STREAM_H

#include "daemon_options.h"
#include "daemon_stats.h"

/* The daemon looks about so often. */
#define DAEMON_POLL_MS 100
/* After a stop the bridge sends its last frame within a tick; a simulated one takes as long as its machine needs. */
#define DAEMON_DRAIN_MS 10000

struct daemon_stream {
    const struct daemon_options *options;
    struct whisker_device *device; /* NULL: waiting for one */
    struct whisker_ring *ring;
    struct whisker_decoder decoder;
    struct whisker_clock_fit clock;
    struct daemon_stats stats;
    int64_t tell_at_ms;
    struct whisker_timing ticks; /* of tick_in, when last asked for */
    uint32_t ticks_told;         /* bit n: error TICK_IN_SILENT - n of this run is in the log */
    bool last_seen;
    bool damage_told;
};

/* From now on SIGUSR1 and SIGUSR2 are requests for the log: statistics, and the nodes. */
void daemon_stream_catch_requests(void);

/* Into this ring, no bridge yet. */
void daemon_stream_init(struct daemon_stream *stream, const struct daemon_options *options, struct whisker_ring *ring);

/* A bridge will be started: the counts stay, half a frame from before does not; readers are told that something is
 * missing, but of the first. */
void daemon_stream_begin(struct daemon_stream *stream, bool first);

/* Sink of the device; context: the stream. */
void daemon_stream_take(void *context, const uint8_t *bytes, size_t count);

/* Returns 0 when told to stop and all is received, or why the stream has ended. */
int daemon_stream_run(struct daemon_stream *stream);

/* What is due beside the frames, now and then; also while there is no bridge. */
void daemon_stream_keep_house(struct daemon_stream *stream);

/* Clock mapping and statistics into the ring. */
void daemon_stream_tell(struct daemon_stream *stream);

/* Tells readers and log the last of it. */
void daemon_stream_end(struct daemon_stream *stream);

#endif
