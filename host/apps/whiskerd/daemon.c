#include "daemon.h"

#include "cli.h"
#include "daemon_log.h"
#include "daemon_notify.h"
#include "daemon_ring.h"
#include "daemon_stream.h"

struct daemon {
    struct daemon_stream stream;
    struct whisker_hotplug *hotplug; /* while a bridge is waited for */
};

/* Tries once. False: it is not worth to wait; the reason has been logged. */
static bool daemon_connect_first(struct daemon_stream *stream)
{
    struct whisker_identity identity;
    const int error = stream->bridge.logged = daemon_stream_connect(stream, &identity);
    if (error && !stream->options->wait) {
        daemon_bridge_log_refusal(error, &identity);
        return false;
    }
    if (error) {
        daemon_log_error(LOG_NOTE, DAEMON_BRIDGE, error);
        daemon_notify_ready("waiting for a bridge");
    }
    return true;
}

/* Tries again; a reason is logged once, not every second. */
static void daemon_connect_again(struct daemon_stream *stream)
{
    struct daemon_bridge *bridge = &stream->bridge;
    struct whisker_identity identity;
    const int error = daemon_stream_connect(stream, &identity);
    const bool away = error == WHISKER_ERROR_DEVICE_SERIAL && bridge->lost_at_ms != 0; /* its loss is in the log */
    if (error && error != bridge->logged && !away) {
        daemon_bridge_log_refusal(error, &identity);
    }
    bridge->logged = error;
}

/* While the bridge is missing: waits for it. Returns 0 or why it cannot even look. */
static int daemon_await_bridge(struct daemon *daemon)
{
    struct daemon_stream *stream = &daemon->stream;
    if (stream->bridge.device) {
        whisker_hotplug_close(daemon->hotplug);
        daemon->hotplug = NULL;
        return WHISKER_OK;
    }
    const int error = daemon->hotplug ? WHISKER_OK : whisker_hotplug_open(&daemon->hotplug);
    if (error) {
        daemon_log_error(LOG_ERROR, DAEMON_BRIDGE, error);
    } else if (whisker_hotplug_wait(daemon->hotplug, DAEMON_POLL_MS) == WHISKER_OK) {
        daemon_connect_again(stream);
    }
    return error;
}

/* Streams and waits. Returns 0 after a wish to stop, or why it cannot go on, which has been logged. */
static int daemon_serve(struct daemon *daemon)
{
    struct daemon_stream *stream = &daemon->stream;
    while (!cli_stop_wanted()) {
        const int gone = daemon_stream_receive(stream);
        if (gone && stream->options->once) {
            return gone;
        }
        const int error = daemon_await_bridge(daemon);
        if (error) {
            return error;
        }
        daemon_stream_keep_house(stream);
    }
    return daemon_stream_drain(stream);
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
    const bool failed = !daemon_connect_first(&daemon.stream) || daemon_serve(&daemon) != WHISKER_OK;
    daemon_notify_stopping();
    whisker_hotplug_close(daemon.hotplug);
    const bool whole = daemon_stream_end(&daemon.stream);
    whisker_ring_close(ring);
    return failed || !whole ? CLI_FAILED : CLI_OK;
}
