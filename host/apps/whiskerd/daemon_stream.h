/* Passes what one bridge sends, or two, to the ring: frames, clock mapping, statistics, and what is due beside them. */
#ifndef WHISKER_DAEMON_STREAM_H
#define WHISKER_DAEMON_STREAM_H

#include "daemon_bridge.h"
#include "daemon_options.h"

/* After a stop the bridge sends its last frame within a tick; a simulated one takes as long as its machine needs. */
#define DAEMON_DRAIN_MS 10000
#define DAEMON_BRIDGES 2

struct daemon_stream;

/* What a bridge's sink gets. */
struct daemon_inlet {
    struct daemon_stream *stream;
    int bridge;
};

struct daemon_stream {
    const struct daemon_options *options;
    struct whisker_ring *ring;
    struct daemon_bridge bridge[DAEMON_BRIDGES];
    struct daemon_inlet inlet[DAEMON_BRIDGES];
    int bridges; /* of them in use */
    struct whisker_pair pair;
    struct whisker_pair_counts pair_reported; /* what of it is in the log */
    struct whisker_clock_fit clock;
    struct daemon_stats stats;
    int64_t report_at_ms;
};

/* Makes SIGUSR1 and SIGUSR2 requests for the log: statistics, and the nodes. */
void daemon_stream_catch_requests(void);

/* Into this ring, no bridge yet. */
void daemon_stream_init(struct daemon_stream *stream, const struct daemon_options *options, struct whisker_ring *ring);

/* Opens and starts a bridge. Returns 0, or why not; nothing has been logged then. */
int daemon_stream_connect(struct daemon_stream *stream, int bridge, struct whisker_identity *identity);

/* Bridges that stream. */
int daemon_stream_connected(const struct daemon_stream *stream);

/* Receives what has come, or waits for it. Returns 0, or why a bridge has gone, which has been logged. */
int daemon_stream_receive(struct daemon_stream *stream);

/* Stops the bridges and receives what they still send. Returns 0, or why a stream did not end as it should, which has
 * been logged. */
int daemon_stream_drain(struct daemon_stream *stream);

/* What is due beside the frames, now and then; also while there is no bridge. */
void daemon_stream_keep_house(struct daemon_stream *stream);

/* Clock mapping and statistics into the ring. */
void daemon_stream_report(struct daemon_stream *stream);

/* Closes the bridges; passes the last of it to readers and log. Returns false if a bridge sent malformed frames. */
bool daemon_stream_end(struct daemon_stream *stream);

#endif
