#include "daemon_stats.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "daemon_log.h"
#include "whisker_protocol.h"

static int64_t daemon_stats_realtime_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

void daemon_stats_begin(struct daemon_stats *stats, const struct whisker_settings *settings)
{
    memset(stats, 0, sizeof *stats);
    stats->reported.started_ns = daemon_stats_realtime_ns();
    stats->reported.lane_mask = settings->lane_mask;
    stats->reported.tick_period = settings->tick_period;
}

void daemon_stats_connected(struct daemon_stats *stats, struct daemon_source *source,
                            const struct whisker_device_info *about, const struct whisker_identity *identity)
{
    struct whisker_daemon_stats *reported = &stats->reported;
    reported->connected = 1;
    reported->error = WHISKER_OK;
    reported->connected_ns = daemon_stats_realtime_ns();
    source->dropped = 0;
    source->has_sequence = false;
    reported->wire_version = identity->wire_version;
    reported->gateware = identity->gateware;
    reported->usb_mbit = about->usb_mbit;
    memcpy(reported->serial, about->serial, sizeof reported->serial);
    snprintf(reported->firmware, sizeof reported->firmware, "gateware %u, wire %u", identity->gateware,
             identity->wire_version);
}

void daemon_stats_lost(struct daemon_stats *stats, bool was_connected, int error)
{
    if (was_connected) {
        stats->reported.connected = 0;
        stats->reported.connected_ns = daemon_stats_realtime_ns();
        stats->reported.usb_errors += error != WHISKER_ERROR_DEVICE_GONE;
    }
    stats->reported.error = error;
}

static void daemon_stats_count_record(struct daemon_stats *stats, unsigned status)
{
    switch (status >> WHISKER_STATUS_ERROR_BITS) {
    case WHISKER_CODE_ABSENT:
        stats->reported.records_absent++;
        break;
    case WHISKER_CODE_LINK_CRC:
        stats->records_link_crc++;
        break;
    case WHISKER_CODE_LINK_TICK:
        stats->reported.records_tick++;
        break;
    case WHISKER_CODE_LANE_OFF:
        break;
    default:
        stats->reported.records_sensor++;
    }
}

void daemon_stats_frame(struct daemon_stats *stats, struct daemon_source *source, const struct whisker_frame *frame)
{
    const uint32_t missing = source->has_sequence ? frame->sequence - source->sequence - 1 : 0; /* modulo 2^32 */
    stats->reported.frames_missing += missing < UINT32_MAX / 2 ? missing : 0;
    source->sequence = frame->sequence;
    source->has_sequence = true;
    source->frames_dropped += (uint32_t)(frame->dropped - source->dropped);
    source->dropped = frame->dropped;
    for (size_t lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        const unsigned status = frame->lane[lane].status;
        if (status != 0 && (frame->lane_mask >> lane & 1u)) {
            daemon_stats_count_record(stats, status);
        }
    }
}

void daemon_stats_settle(struct daemon_stats *stats, const struct daemon_source *source,
                         const struct whisker_clock_fit *clock)
{
    struct whisker_daemon_stats *reported = &stats->reported;
    const struct whisker_decoder_counts *counts = &source->decoder.counts;
    reported->frames = counts->frames;
    reported->frames_damaged = counts->frames_damaged;
    reported->frames_dropped = source->frames_dropped;
    reported->bytes_skipped = counts->bytes_skipped;
    reported->records_usb = counts->records_damaged;
    reported->records_crc =
        stats->records_link_crc > reported->records_usb ? stats->records_link_crc - reported->records_usb : 0;
    reported->clock_restarts = clock->restarts;
}

void daemon_stats_log(const struct whisker_daemon_stats *reported)
{
    daemon_log(LOG_NOTE,
               "%" PRIu64 " frames published, %" PRIu64 " missing, %" PRIu64 " dropped by the bridge, %" PRIu64
               " with damaged records, %" PRIu64 " bytes skipped; records: %" PRIu64 " absent, %" PRIu64
               " crc, %" PRIu64 " tick, %" PRIu64 " sensor, %" PRIu64 " usb; %" PRIu64 " reconnects, %" PRIu64
               " usb errors",
               reported->frames, reported->frames_missing, reported->frames_dropped, reported->frames_damaged,
               reported->bytes_skipped, reported->records_absent, reported->records_crc, reported->records_tick,
               reported->records_sensor, reported->records_usb, reported->reconnects, reported->usb_errors);
}
