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
    *stream = (struct daemon_stream){.options = options, .ring = ring};
    stream->bridge = (struct daemon_bridge){.serial = options->serial, .settings = options->settings};
    whisker_decoder_init(&stream->bridge.source.decoder);
    whisker_clock_begin(&stream->clock, WHISKER_LIMIT_CLOCK_HZ, whisker_settings_latency_ns(&options->settings));
    daemon_stats_begin(&stream->stats, &options->settings);
}

static int64_t daemon_stream_clock_ns(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* The first mapping is reported at once, so that a reader of the first frames can date them. */
static void daemon_stream_map_clock(struct daemon_stream *stream, const struct whisker_frame *newest)
{
    const bool first = !stream->clock.begun;
    const uint16_t usb_time = (uint16_t)(newest->flags >> WHISKER_FRAME_USB_TIME_SHIFT);
    const int error =
        whisker_clock_add(&stream->clock, newest->time_cycles, usb_time, daemon_stream_clock_ns(CLOCK_MONOTONIC),
                          daemon_stream_clock_ns(CLOCK_REALTIME));
    if (error) {
        daemon_log_error(LOG_WARN, "clock", error);
    }
    if (first) {
        daemon_stream_report(stream);
    }
}

static void daemon_stream_note(struct daemon_stream *stream, const struct whisker_frame *frame)
{
    stream->bridge.last_seen |= (frame->flags & WHISKER_FRAME_LAST) != 0;
    stream->bridge.dated = frame->flags >> WHISKER_FRAME_USB_TIME_SHIFT != 0;
    daemon_stats_frame(&stream->stats, &stream->bridge.source, frame);
}

static void daemon_stream_take(void *context, const uint8_t *bytes, size_t count)
{
    struct daemon_stream *stream = context;
    const struct whisker_frame *frames;
    size_t made;
    if (whisker_ring_feed(stream->ring, &stream->bridge.source.decoder, bytes, count, &frames, &made) != 0 ||
        made == 0) {
        return;
    }
    for (size_t i = 0; i < made; i++) {
        daemon_stream_note(stream, &frames[i]);
    }
    daemon_stream_map_clock(stream, &frames[made - 1]);
}

static void daemon_stream_announce(struct daemon_stream *stream, const struct whisker_identity *identity)
{
    const struct daemon_bridge *bridge = &stream->bridge;
    const struct whisker_device_info *about = whisker_device_about(bridge->device);
    const bool back = bridge->lost_at_ms != 0;
    char line[256];
    snprintf(line, sizeof line, DAEMON_BRIDGE " %s (gateware %u, wire %u) at %s streams into ring %s", about->serial,
             identity->gateware, identity->wire_version, about->path, stream->options->ring);
    stream->stats.reported.reconnects += back;
    daemon_stream_report(stream);
    daemon_log(LOG_DETAIL, "%s", line);
    daemon_notify_ready(line);
    if (back) {
        daemon_log(LOG_NOTE, DAEMON_BRIDGE ": %s is back after %.1f s", about->serial,
                   (double)(cli_now_ms() - bridge->lost_at_ms) * 1e-3);
    }
}

int daemon_stream_connect(struct daemon_stream *stream, struct whisker_identity *identity)
{
    const int error = daemon_bridge_connect(&stream->bridge, &stream->stats, daemon_stream_take, stream, identity);
    if (error) {
        daemon_stats_lost(&stream->stats, false, error);
    } else {
        daemon_stream_announce(stream, identity);
    }
    return error;
}

int daemon_stream_receive(struct daemon_stream *stream)
{
    struct whisker_device *device = stream->bridge.device;
    const int error = device ? whisker_device_poll(device, DAEMON_POLL_MS) : WHISKER_OK;
    if (error) {
        daemon_bridge_lose(&stream->bridge, &stream->stats, error);
        daemon_stream_report(stream);
        daemon_notify_ready("the bridge has gone; waiting for it");
    }
    return error;
}

void daemon_stream_report(struct daemon_stream *stream)
{
    struct whisker_clock clock;
    daemon_stats_settle(&stream->stats, &stream->bridge.source, &stream->clock);
    whisker_clock_get(&stream->clock, &clock);
    whisker_ring_set_clock(stream->ring, &clock);
    whisker_ring_set_stats(stream->ring, &stream->stats.reported);
}

static void daemon_stream_list_nodes(struct daemon_stream *stream)
{
    static struct daemon_report report;
    report.used = 0;
    daemon_nodes_log(stream->bridge.device, stream->bridge.settings.lane_mask, &report);
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
        daemon_stats_log(&stream->stats.reported);
    }
    if (nodes_wanted && stream->bridge.device) {
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
    }
    daemon_bridge_report_damage(&stream->bridge);
    if (due) {
        daemon_bridge_look_at_ticks(&stream->bridge, &stream->clock);
    }
    daemon_stream_answer_requests(stream);
}

int daemon_stream_drain(struct daemon_stream *stream)
{
    struct daemon_bridge *bridge = &stream->bridge;
    if (!bridge->device) {
        return WHISKER_OK;
    }
    const int64_t give_up_ms = cli_now_ms() + DAEMON_DRAIN_MS;
    int error = whisker_device_stop(bridge->device);
    while (!error && !bridge->last_seen && cli_now_ms() < give_up_ms) {
        error = whisker_device_poll(bridge->device, DAEMON_POLL_MS);
    }
    error = !error && !bridge->last_seen ? WHISKER_ERROR_DEVICE_DRAIN : error;
    if (error) {
        daemon_log_error(LOG_ERROR, DAEMON_BRIDGE, error);
    }
    whisker_device_flush(bridge->device);
    return error;
}

bool daemon_stream_end(struct daemon_stream *stream)
{
    struct daemon_bridge *bridge = &stream->bridge;
    whisker_device_close(bridge->device);
    bridge->device = NULL;
    whisker_decoder_end(&bridge->source.decoder);
    daemon_bridge_report_damage(bridge);
    daemon_stream_report(stream);
    if (stream->stats.reported.connected_ns != 0) {
        daemon_stats_log(&stream->stats.reported);
    }
    return !bridge->damage_reported;
}
