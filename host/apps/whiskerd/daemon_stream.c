#include "daemon_stream.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "cli.h"
#include "daemon_log.h"
#include "daemon_nodes.h"
#include "daemon_notify.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

/* How often clock mapping is published to readers and statistics. */
#define TELL_MS 250

static volatile sig_atomic_t report_wanted, nodes_wanted;

static void daemon_stream_on_request(int number)
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
    action.sa_handler = daemon_stream_on_request;
    sigaction(SIGUSR1, &action, NULL);
    sigaction(SIGUSR2, &action, NULL);
}

void daemon_stream_init(struct daemon_stream *stream, const struct daemon_options *options, struct whisker_ring *ring)
{
    *stream = (struct daemon_stream){.options = options, .ring = ring, .bridges = options->second ? 2 : 1};
    stream->bridge[0] =
        (struct daemon_bridge){.name = "bridge", .serial = options->serial, .settings = options->settings};
    stream->bridge[1] = stream->bridge[0];
    stream->bridge[1].name = "second bridge";
    stream->bridge[1].serial = options->second;
    stream->bridge[1].source.is_second = true;
    stream->bridge[1].settings.lane_mask = options->second_lane_mask;
    stream->bridge[1].settings.options |= WHISKER_OPTION_TICK_IN;
    whisker_pair_init(&stream->pair, options->settings.tick_period);
    for (int i = 0; i < stream->bridges; i++) {
        stream->inlet[i] = (struct daemon_inlet){stream, i};
        whisker_decoder_init(&stream->bridge[i].source.decoder);
        whisker_pair_run(&stream->pair, i, false);
    }
    whisker_clock_begin(&stream->clock, WHISKER_LIMIT_CLOCK_HZ, whisker_settings_latency_ns(&options->settings));
    daemon_stats_begin(&stream->stats, &options->settings, stream->bridges,
                       options->second ? options->second_lane_mask : 0);
}

static int64_t daemon_stream_clock_ns(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static void daemon_stream_map_clock(struct daemon_stream *stream, const struct whisker_frame *newest, uint64_t cycles)
{
    const uint16_t usb_time = (uint16_t)(newest->flags >> WHISKER_FRAME_USB_TIME_SHIFT);
    const int error = whisker_clock_add(&stream->clock, cycles, usb_time, daemon_stream_clock_ns(CLOCK_MONOTONIC),
                                        daemon_stream_clock_ns(CLOCK_REALTIME));
    if (error) {
        daemon_log_error(LOG_WARN, "clock", error);
    }
}

static void daemon_stream_note(struct daemon_stream *stream, struct daemon_bridge *bridge,
                               const struct whisker_frame *frame)
{
    bridge->last_seen |= (frame->flags & WHISKER_FRAME_LAST) != 0;
    bridge->dated = frame->flags >> WHISKER_FRAME_USB_TIME_SHIFT != 0;
    daemon_stats_frame(&stream->stats, &bridge->source, frame);
}

static void daemon_stream_publish_pairs(struct daemon_stream *stream)
{
    struct whisker_frame frames[DAEMON_BRIDGES];
    for (int made; (made = whisker_pair_next(&stream->pair, frames)) > 0;) {
        whisker_ring_publish(stream->ring, frames, (size_t)made);
    }
}

/* The ring's time is the first bridge's, or goes on as it was while that is away. */
static void daemon_stream_take_one_of_two(struct daemon_stream *stream, int i, const uint8_t *bytes, size_t count)
{
    struct daemon_bridge *bridge = &stream->bridge[i];
    struct whisker_frame frame;
    bool any = false;
    while (whisker_decoder_next(&bridge->source.decoder, &bytes, &count, &frame)) {
        daemon_stream_note(stream, bridge, &frame);
        whisker_pair_add(&stream->pair, i, &frame);
        daemon_stream_publish_pairs(stream);
        any = true;
    }
    if (any && (i == 0 || !stream->bridge[0].device)) {
        const int64_t ahead = i * stream->pair.offset * stream->options->settings.tick_period;
        daemon_stream_map_clock(stream, &frame, frame.time_cycles + (uint64_t)ahead);
    }
}

static void daemon_stream_take(void *context, const uint8_t *bytes, size_t count)
{
    const struct daemon_inlet *inlet = context;
    struct daemon_stream *stream = inlet->stream;
    struct daemon_bridge *bridge = &stream->bridge[0];
    const struct whisker_frame *frames;
    size_t made;
    if (stream->bridges > 1) {
        daemon_stream_take_one_of_two(stream, inlet->bridge, bytes, count);
    } else if (whisker_ring_feed(stream->ring, &bridge->source.decoder, bytes, count, &frames, &made) == 0 &&
               made > 0) {
        for (size_t i = 0; i < made; i++) {
            daemon_stream_note(stream, bridge, &frames[i]);
        }
        daemon_stream_map_clock(stream, &frames[made - 1], frames[made - 1].time_cycles);
    }
}

static void daemon_stream_announce(struct daemon_stream *stream, const struct daemon_bridge *bridge,
                                   const struct whisker_identity *identity)
{
    const struct whisker_device_info *about = whisker_device_about(bridge->device);
    const bool back = bridge->lost_at_ms != 0;
    char line[256];
    snprintf(line, sizeof line, "%s %s (gateware %u, wire %u) at %s streams into ring %s", bridge->name, about->serial,
             identity->gateware, identity->wire_version, about->path, stream->options->ring);
    stream->stats.reported.reconnects += back;
    daemon_stream_report(stream);
    daemon_log(LOG_DETAIL, "%s", line);
    daemon_notify_ready(line);
    if (back) {
        daemon_log(LOG_NOTE, "%s: %s is back after %.1f s", bridge->name, about->serial,
                   (double)(cli_now_ms() - bridge->lost_at_ms) * 1e-3);
    }
}

int daemon_stream_connect(struct daemon_stream *stream, int i, struct whisker_identity *identity)
{
    struct daemon_bridge *bridge = &stream->bridge[i];
    whisker_pair_run(&stream->pair, i, true);
    const int error = daemon_bridge_connect(bridge, &stream->stats, daemon_stream_take, &stream->inlet[i], identity);
    if (error) {
        whisker_pair_run(&stream->pair, i, false);
        daemon_stream_publish_pairs(stream);
        daemon_stats_lost(&stream->stats, false, error);
    } else {
        daemon_stream_announce(stream, bridge, identity);
    }
    return error;
}

static void daemon_stream_lose(struct daemon_stream *stream, int i, int error)
{
    daemon_bridge_lose(&stream->bridge[i], &stream->stats, error);
    whisker_pair_run(&stream->pair, i, false);
    daemon_stream_publish_pairs(stream);
    daemon_stream_report(stream);
    daemon_notify_ready("the bridge has gone; waiting for it");
}

int daemon_stream_connected(const struct daemon_stream *stream)
{
    return (int)stream->stats.reported.connected;
}

/* Receives what has come, or waits for it; error[i]: why a bridge's stream has ended. */
static void daemon_stream_receive_all(struct daemon_stream *stream, int error[DAEMON_BRIDGES])
{
    struct whisker_device *open[DAEMON_BRIDGES];
    int count = 0;
    for (int i = 0; i < stream->bridges; i++) {
        if (stream->bridge[i].device) {
            open[count++] = stream->bridge[i].device;
        }
    }
    if (count > 1) {
        whisker_device_wait(open, count, DAEMON_POLL_MS);
    }
    for (int i = 0; i < stream->bridges; i++) {
        struct whisker_device *device = stream->bridge[i].device;
        error[i] = device ? whisker_device_poll(device, count > 1 ? 0 : DAEMON_POLL_MS) : WHISKER_OK;
    }
}

int daemon_stream_receive(struct daemon_stream *stream)
{
    int error[DAEMON_BRIDGES], last = WHISKER_OK;
    daemon_stream_receive_all(stream, error);
    for (int i = 0; i < stream->bridges; i++) {
        if (error[i]) {
            daemon_stream_lose(stream, i, error[i]);
            last = error[i];
        }
    }
    return last;
}

static void daemon_stream_report_pair(struct daemon_stream *stream)
{
    const struct whisker_pair_counts *now = &stream->pair.counts, *reported = &stream->pair_reported;
    if (now->realigned != reported->realigned) {
        daemon_log(LOG_NOTE, "second bridge: its tick 0 is tick %lld of the first", (long long)stream->pair.offset);
    }
    if (now->apart != 0 && reported->apart == 0) {
        daemon_log(LOG_WARN,
                   "second bridge: out of step: its ticks come more than 125 us beside the first one's, or the "
                   "two are on two host controllers; wire its tick_in to the first one's tick_out, use one hub");
    }
    stream->pair_reported = *now;
}

static void daemon_stream_log_stats(const struct daemon_stream *stream)
{
    const struct whisker_pair_counts *pair = &stream->pair.counts;
    daemon_stats_log(&stream->stats.reported);
    if (stream->bridges > 1) {
        daemon_log(
            LOG_NOTE,
            "two bridges: %llu ticks of both, %llu of the first alone, %llu of the second alone, %llu out of step, "
            "%llu times realigned",
            (unsigned long long)pair->paired, (unsigned long long)pair->alone[0], (unsigned long long)pair->alone[1],
            (unsigned long long)pair->apart, (unsigned long long)pair->realigned);
    }
}

void daemon_stream_report(struct daemon_stream *stream)
{
    struct whisker_clock clock;
    daemon_stats_settle_begin(&stream->stats);
    for (int i = 0; i < stream->bridges; i++) {
        daemon_stats_settle(&stream->stats, &stream->bridge[i].source);
    }
    daemon_stats_settle_end(&stream->stats, &stream->clock);
    whisker_clock_get(&stream->clock, &clock);
    whisker_ring_set_clock(stream->ring, &clock);
    whisker_ring_set_stats(stream->ring, &stream->stats.reported);
}

static void daemon_stream_report_bridges(struct daemon_stream *stream, bool ticks)
{
    for (int i = 0; i < stream->bridges; i++) {
        daemon_bridge_report_damage(&stream->bridge[i]);
        if (ticks) {
            daemon_bridge_look_at_ticks(&stream->bridge[i], i == 0 ? &stream->clock : NULL);
        }
    }
}

static void daemon_stream_list_nodes(struct daemon_stream *stream)
{
    static struct daemon_report report;
    report.used = 0;
    for (int i = 0; i < stream->bridges; i++) {
        if (stream->bridge[i].device) {
            daemon_nodes_log(stream->bridge[i].device, stream->bridge[i].settings.lane_mask, &report);
        }
    }
    const int error = whisker_ring_set_nodes(stream->ring, report.text);
    if (error) {
        daemon_log_error(LOG_WARN, "nodes, for readers", error);
    }
}

static void daemon_stream_answer_requests(struct daemon_stream *stream)
{
    if (report_wanted) {
        report_wanted = 0;
        daemon_stream_report(stream);
        daemon_stream_log_stats(stream);
    }
    if (nodes_wanted && daemon_stream_connected(stream) > 0) {
        nodes_wanted = 0;
        daemon_stream_list_nodes(stream);
    }
}

void daemon_stream_keep_house(struct daemon_stream *stream)
{
    daemon_notify_alive();
    const int64_t left_ms = stream->report_at_ms - cli_now_ms();
    const bool due = left_ms <= 0 || left_ms > TELL_MS; /* more: the clock went back */
    if (due) {
        stream->report_at_ms = cli_now_ms() + TELL_MS;
        daemon_stream_report(stream);
        daemon_stream_report_pair(stream);
    }
    daemon_stream_report_bridges(stream, due);
    daemon_stream_answer_requests(stream);
}

/* Receives what a bridge still sends after a stop, up to its last frame. */
static int daemon_stream_drain_bridge(struct daemon_stream *stream, int i)
{
    struct daemon_bridge *bridge = &stream->bridge[i];
    const int64_t give_up_ms = cli_now_ms() + DAEMON_DRAIN_MS;
    int error[DAEMON_BRIDGES];
    error[i] = whisker_device_stop(bridge->device);
    while (!error[i] && !bridge->last_seen && cli_now_ms() < give_up_ms) {
        daemon_stream_receive_all(stream, error);
    }
    return !error[i] && !bridge->last_seen ? WHISKER_ERROR_DEVICE_DRAIN : error[i];
}

/* The second first: it needs the first one's ticks for its last frame. */
int daemon_stream_drain(struct daemon_stream *stream)
{
    int error = WHISKER_OK;
    for (int i = stream->bridges - 1; i >= 0; i--) {
        const int ended = stream->bridge[i].device ? daemon_stream_drain_bridge(stream, i) : WHISKER_OK;
        if (ended) {
            daemon_log_error(LOG_ERROR, stream->bridge[i].name, ended);
            error = ended;
        }
    }
    for (int i = stream->bridges - 1; i >= 0; i--) {
        if (stream->bridge[i].device) {
            whisker_device_flush(stream->bridge[i].device);
        }
        whisker_pair_run(&stream->pair, i, false);
    }
    daemon_stream_publish_pairs(stream);
    return error;
}

bool daemon_stream_end(struct daemon_stream *stream)
{
    bool whole = true;
    for (int i = 0; i < stream->bridges; i++) {
        struct daemon_bridge *bridge = &stream->bridge[i];
        whisker_device_close(bridge->device);
        bridge->device = NULL;
        whisker_decoder_end(&bridge->source.decoder);
        daemon_bridge_report_damage(bridge);
        whole &= !bridge->damage_reported;
    }
    daemon_stream_report(stream);
    if (stream->stats.reported.connected_ns != 0) {
        daemon_stream_log_stats(stream);
    }
    return whole;
}
