#include "daemon_stream.h"

#include <signal.h>
#include <string.h>
#include <time.h>

#include "cli.h"
#include "daemon_log.h"
#include "daemon_nodes.h"
#include "daemon_notify.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

/* How often readers are told clock mapping and statistics. */
#define TELL_MS 250

static volatile sig_atomic_t report_wanted, nodes_wanted;

static void on_request(int number)
{
    if (number == SIGUSR1) {
        report_wanted = 1;
    } else {
        nodes_wanted = 1;
    }
}

void daemon_stream_catch_requests(void)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_request;
    sigaction(SIGUSR1, &action, NULL);
    sigaction(SIGUSR2, &action, NULL);
}

void daemon_stream_init(struct daemon_stream *stream, const struct daemon_options *options, struct whisker_ring *ring)
{
    *stream = (struct daemon_stream){.options = options, .ring = ring};
    whisker_decoder_init(&stream->decoder);
    whisker_clock_begin(&stream->clock, WHISKER_LIMIT_CLOCK_HZ, whisker_settings_latency_ns(&options->settings));
    daemon_stats_begin(&stream->stats, &options->settings);
}

void daemon_stream_begin(struct daemon_stream *stream, bool first)
{
    struct whisker_decoder *decoder = &stream->decoder;
    whisker_decoder_end(decoder);
    const struct whisker_decoder_counts counts = decoder->counts;
    whisker_decoder_init(decoder);
    decoder->counts = counts;
    decoder->mark = first ? 0 : WHISKER_FRAME_GAP;
    stream->ticks = (struct whisker_timing){0};
    stream->ticks_told = 0;
    stream->last_seen = false;
}

static int64_t clock_ns(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static void map_clock(struct daemon_stream *stream, const struct whisker_frame *newest)
{
    const int error =
        whisker_clock_add(&stream->clock, newest->time_cycles, clock_ns(CLOCK_MONOTONIC), clock_ns(CLOCK_REALTIME));
    if (error) {
        daemon_log_error(LOG_WARN, "clock", error);
    }
}

void daemon_stream_take(void *context, const uint8_t *bytes, size_t count)
{
    struct daemon_stream *stream = context;
    const struct whisker_frame *frames;
    size_t made;
    if (whisker_ring_feed(stream->ring, &stream->decoder, bytes, count, &frames, &made) == 0 && made > 0) {
        stream->last_seen |= (frames[made - 1].flags & WHISKER_FRAME_LAST) != 0;
        daemon_stats_frames(&stream->stats, frames, made);
        map_clock(stream, &frames[made - 1]);
    }
}

/* USB guards every packet by a CRC of its own, so a malformed frame is a fault of the bridge: said once, and again in
 * the exit code, while the other frames go on. */
static void tell_damage(struct daemon_stream *stream)
{
    const struct whisker_decoder *decoder = &stream->decoder;
    if (decoder->first_error && !stream->damage_told) {
        daemon_log(LOG_ERROR, "bridge: after frame %llu: %s; %s", (unsigned long long)decoder->counts.frames,
                   whisker_error_text(decoder->first_error), whisker_error_remedy(decoder->first_error));
        stream->damage_told = true;
    }
}

/* What is wrong with the pin that the ticks come from: each kind once in a run, with the counts. */
static void tell_ticks(struct daemon_stream *stream)
{
    struct whisker_timing now;
    if (!stream->device || !(stream->options->settings.options & WHISKER_OPTION_TICK_IN) ||
        whisker_device_timing(stream->device, &now) != WHISKER_OK) {
        return;
    }
    const int error = whisker_timing_judge(&stream->ticks, &now);
    const uint32_t bit = error ? UINT32_C(1) << (WHISKER_ERROR_TICK_IN_SILENT - error) : 0;
    stream->ticks = now;
    if (bit & ~stream->ticks_told) {
        stream->ticks_told |= bit;
        daemon_log_error(LOG_WARN, "tick_in", error);
        daemon_log(LOG_NOTE, "tick_in: %u edges taken, %u early, %u uneven, %u silences; shortest distance %u cycles",
                   now.edges, now.early, now.uneven, now.silent, now.shortest);
    }
}

void daemon_stream_tell(struct daemon_stream *stream)
{
    struct whisker_clock clock;
    daemon_stats_settle(&stream->stats, &stream->decoder.counts, &stream->clock);
    whisker_clock_get(&stream->clock, &clock);
    whisker_ring_set_clock(stream->ring, &clock);
    whisker_ring_set_stats(stream->ring, &stream->stats.told);
}

void daemon_stream_keep_house(struct daemon_stream *stream)
{
    daemon_notify_alive();
    tell_damage(stream);
    const int64_t left_ms = stream->tell_at_ms - cli_now_ms();
    if (left_ms <= 0 || left_ms > TELL_MS) { /* more: the clock went back */
        stream->tell_at_ms = cli_now_ms() + TELL_MS;
        daemon_stream_tell(stream);
        tell_ticks(stream);
    }
    if (report_wanted) {
        report_wanted = 0;
        daemon_stream_tell(stream);
        daemon_stats_log(&stream->stats.told);
    }
    if (nodes_wanted && stream->device) {
        nodes_wanted = 0;
        daemon_nodes_log(stream->device, stream->options->settings.lane_mask);
    }
}

/* Receives what the bridge still sends after a stop, up to its last frame. */
static int drain(struct daemon_stream *stream)
{
    const int64_t give_up_ms = cli_now_ms() + DAEMON_DRAIN_MS;
    int error = whisker_device_stop(stream->device);
    while (!error && !stream->last_seen && cli_now_ms() < give_up_ms) {
        error = whisker_device_poll(stream->device, DAEMON_POLL_MS);
    }
    whisker_device_flush(stream->device);
    return !error && !stream->last_seen ? WHISKER_ERROR_DEVICE_DRAIN : error;
}

int daemon_stream_run(struct daemon_stream *stream)
{
    int error = WHISKER_OK;
    while (!error && !cli_stop_wanted()) {
        error = whisker_device_poll(stream->device, DAEMON_POLL_MS);
        daemon_stream_keep_house(stream);
    }
    return error ? error : drain(stream);
}

void daemon_stream_end(struct daemon_stream *stream)
{
    whisker_decoder_end(&stream->decoder);
    tell_damage(stream);
    daemon_stream_tell(stream);
    if (stream->stats.told.connected_ns != 0) {
        daemon_stats_log(&stream->stats.told);
    }
}
