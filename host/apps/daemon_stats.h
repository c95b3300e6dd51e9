/* The daemon's statistics: counted frame by frame, told in the ring and in the log. */
#ifndef WHISKER_DAEMON_STATS_H
#define WHISKER_DAEMON_STATS_H

#include <stdbool.h>
#include <stddef.h>

#include "whisker/whisker.h"

struct daemon_stats {
    struct whisker_daemon_stats told;
    uint64_t records_link_crc; /* found by bridge or host: the frame does not say which */
    uint64_t dropped_before;   /* in the bridge's earlier runs */
    uint32_t dropped;          /* in this one */
    uint32_t sequence;         /* of the latest frame */
    bool has_sequence;
};

void daemon_stats_begin(struct daemon_stats *stats, const struct whisker_settings *settings);

/* A bridge has been started. */
void daemon_stats_connected(struct daemon_stats *stats, const struct whisker_device_info *about,
                            const struct whisker_identity *identity);

/* It has gone. error: why. */
void daemon_stats_lost(struct daemon_stats *stats, int error);

/* Counts frames just published. */
void daemon_stats_frames(struct daemon_stats *stats, const struct whisker_frame *frames, size_t count);

/* Takes over what the decoder and the clock fit have counted; then `told` is what is to be told. */
void daemon_stats_settle(struct daemon_stats *stats, const struct whisker_decoder_counts *counts,
                         const struct whisker_clock_fit *clock);

/* Logs it as one line. */
void daemon_stats_log(const struct whisker_daemon_stats *told);

#endif
