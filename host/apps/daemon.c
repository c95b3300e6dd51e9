#include "daemon.h"

#include <stdio.h>

#include "cli.h"
#include "daemon_log.h"
#include "daemon_notify.h"
#include "daemon_ring.h"
#include "daemon_stream.h"
#include "whisker_protocol.h"

#define BRIDGE "bridge"

struct daemon {
    struct daemon_stream stream;
    int64_t lost_at_ms;
    int told; /* why a bridge could not be opened, as last logged */
};

/* Opens the bridge and starts it; on an error nothing stays open. */
static int connect_bridge(struct daemon_stream *stream, struct whisker_identity *identity)
{
    int error = whisker_device_open(stream->options->serial, &stream->device, identity);
    if (error) {
        return error;
    }
    daemon_stats_connected(&stream->stats, whisker_device_about(stream->device), identity);
    error = whisker_device_start(stream->device, &stream->options->settings, daemon_stream_take, stream);
    if (error) {
        daemon_stats_lost(&stream->stats, error);
        whisker_device_close(stream->device);
        stream->device = NULL;
    }
    return error;
}

static void log_refusal(int error, const struct whisker_identity *identity)
{
    if (error == WHISKER_ERROR_WIRE_VERSION) {
        daemon_log(LOG_ERROR, BRIDGE ": %s (bridge %u, host %d); %s", whisker_error_text(error), identity->wire_version,
                   whisker_wire_version(), whisker_error_remedy(error));
    } else {
        daemon_log_error(LOG_ERROR, BRIDGE, error);
    }
}

static void announce(struct daemon_stream *stream)
{
    const struct whisker_daemon_stats *told = &stream->stats.told;
    char line[256];
    snprintf(line, sizeof line, "bridge %s (%s) at %s streams into ring %s", told->serial, told->firmware,
             whisker_device_about(stream->device)->path, stream->options->ring);
    daemon_stream_tell(stream);
    daemon_log(LOG_DETAIL, "%s", line);
    daemon_notify_ready(line);
}

/* Tries once. True: it streams, or it is worth to wait for. Else the reason has been logged. */
static bool connect_first(struct daemon *daemon)
{
    struct whisker_identity identity;
    daemon_stream_begin(&daemon->stream, true);
    const int error = connect_bridge(&daemon->stream, &identity);
    if (!error) {
        announce(&daemon->stream);
        return true;
    }
    daemon_stats_lost(&daemon->stream.stats, error);
    daemon->told = error;
    if (!daemon->stream.options->wait) {
        log_refusal(error, &identity);
        return false;
    }
    daemon_log_error(LOG_NOTE, BRIDGE, error);
    daemon_notify_ready("waiting for a bridge");
    return true;
}

/* Tries again; a reason is logged once, not every second. */
static void connect_again(struct daemon *daemon)
{
    struct whisker_identity identity;
    const bool first = daemon->lost_at_ms == 0;
    daemon_stream_begin(&daemon->stream, first);
    const int error = connect_bridge(&daemon->stream, &identity);
    if (error) {
        daemon_stats_lost(&daemon->stream.stats, error);
        if (error != daemon->told) {
            log_refusal(error, &identity);
        }
        daemon->told = error;
        return;
    }
    daemon->told = WHISKER_OK;
    daemon->stream.stats.told.reconnects += !first;
    announce(&daemon->stream);
    if (!first) {
        daemon_log(LOG_NOTE, BRIDGE ": %s is back after %.1f s", daemon->stream.stats.told.serial,
                   (double)(cli_now_ms() - daemon->lost_at_ms) * 1e-3);
    }
}

/* Waits for a bridge, or for the wish to stop. Returns 0 or why it cannot even wait. */
static int await_bridge(struct daemon *daemon)
{
    struct whisker_hotplug *hotplug;
    const int error = whisker_hotplug_open(&hotplug);
    while (!error && !daemon->stream.device && !cli_stop_wanted()) {
        daemon_stream_keep_house(&daemon->stream);
        if (whisker_hotplug_wait(hotplug, DAEMON_POLL_MS) == WHISKER_OK) {
            connect_again(daemon);
        }
    }
    whisker_hotplug_close(hotplug);
    return error;
}

static void lose_bridge(struct daemon *daemon, int error)
{
    struct daemon_stream *stream = &daemon->stream;
    daemon->lost_at_ms = cli_now_ms();
    daemon->told = error;
    whisker_device_close(stream->device); /* publishes what had come */
    stream->device = NULL;
    daemon_stats_lost(&stream->stats, error);
    daemon_stream_tell(stream);
    daemon_log_error(LOG_WARN, BRIDGE, error);
    daemon_notify_ready("the bridge has gone; waiting for it");
}

/* Streams and waits in turn. Returns 0 when told to stop, or why it cannot go on. */
static int serve(struct daemon *daemon)
{
    while (!cli_stop_wanted()) {
        const int error = daemon->stream.device ? daemon_stream_run(&daemon->stream) : await_bridge(daemon);
        if (!error) {
            continue;
        }
        if (!daemon->stream.device || daemon->stream.options->once || cli_stop_wanted()) {
            daemon_log_error(LOG_ERROR, BRIDGE, error);
            return error;
        }
        lose_bridge(daemon, error);
    }
    return WHISKER_OK;
}

int daemon_run(const struct daemon_options *options)
{
    struct daemon daemon = {0};
    struct whisker_ring *ring;
    daemon_stream_catch_requests();
    if (daemon_ring_make(options, &ring) != WHISKER_OK) {
        return CLI_FAILED;
    }
    daemon_stream_init(&daemon.stream, options, ring);
    const bool failed = !connect_first(&daemon) || serve(&daemon) != WHISKER_OK;
    daemon_notify_stopping();
    daemon_stream_end(&daemon.stream);
    whisker_device_close(daemon.stream.device);
    whisker_ring_close(ring);
    return failed || daemon.stream.damage_told ? CLI_FAILED : CLI_OK;
}
