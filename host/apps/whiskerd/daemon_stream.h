/* Passes what the bridge sends to the ring: frames, clock mapping, statistics, and what is due beside them. */
#ifndef WHISKER_DAEMON_STREAM_H
#define WHISKER_DAEMON_STREAM_H

#include "daemon_bridge.h"
#include "daemon_options.h"

/* After a stop the bridge sends its last frame within a tick; a simulated one takes as long as its machine needs. */
#define DAEMON_DRAIN_MS 10000

struct daemon_stream {
    const struct daemon_options *options;
    struct whisker_ring *ring;
    struct daemon_bridge bridge;
    struct whisker_clock_fit clock;
    struct daemon_stats stats;
    int64_t report_at_ms;
};

/* Makes SIGUSR1 and SIGUSR2 requests for the log: statistics, and the nodes. */
void daemon_stream_catch_requests(void);

/* Into this ring, no bridge yet. */
void daemon_stream_init(struct daemon_stream *stream, const struct daemon_options *options, struct whisker_ring *ring);

/* Opens and starts the bridge. Returns 0, or why not; nothing has been logged then. */
int daemon_stream_connect(struct daemon_stream *stream, struct whisker_identity *identity);

/* Receives what has come, or waits for it; nothing without a bridge. Returns 0, or why the bridge has gone, which has
 * been logged. */
int daemon_stream_receive(struct daemon_stream *stream);

/* Stops the bridge and receives what it still sends. Returns 0, or why the stream did not end as it should, which has
 * been logged. */
int daemon_stream_drain(struct daemon_stream *stream);

/* What is due beside the frames, now and then; also while there is no bridge. */
void daemon_stream_keep_house(struct daemon_stream *stream);

/* Clock mapping and statistics into the ring. */
void daemon_stream_report(struct daemon_stream *stream);

/* Closes the bridge; passes the last of it to readers and log. Returns false if it sent malformed frames. */
bool daemon_stream_end(struct daemon_stream *stream);

#endif
