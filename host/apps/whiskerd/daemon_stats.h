/* The daemon's statistics: counted frame by frame, published in the ring and in the log. */
#ifndef WHISKER_DAEMON_STATS_H
#define WHISKER_DAEMON_STATS_H

#include <stdbool.h>
#include <stddef.h>

#include "whisker/whisker.h"

/* What the bridge sends. */
struct daemon_source {
    struct whisker_decoder decoder;
    uint64_t frames_dropped; /* by the bridge, in all runs */
    uint32_t dropped;        /* as its latest frame says, of this run */
    uint32_t sequence;       /* of the latest frame */
    bool has_sequence;
};

struct daemon_stats {
    struct whisker_daemon_stats reported;
    uint64_t records_link_crc; /* found by bridge or host: the frame does not say which */
};

void daemon_stats_begin(struct daemon_stats *stats, const struct whisker_settings *settings);

/* The bridge has been started. */
void daemon_stats_connected(struct daemon_stats *stats, struct daemon_source *source,
                            const struct whisker_device_info *about, const struct whisker_identity *identity);

/* The bridge has gone, or is not there. error: why. */
void daemon_stats_lost(struct daemon_stats *stats, bool was_connected, int error);

/* Counts a frame. */
void daemon_stats_frame(struct daemon_stats *stats, struct daemon_source *source, const struct whisker_frame *frame);

/* Takes over what the decoder and the clock fit have counted. Then `reported` is up to date. */
void daemon_stats_settle(struct daemon_stats *stats, const struct daemon_source *source,
                         const struct whisker_clock_fit *clock);

/* Logs it as one line. */
void daemon_stats_log(const struct whisker_daemon_stats *reported);

#endif
