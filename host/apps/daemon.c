#include "daemon.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "cli.h"
#include "daemon_log.h"
#include "daemon_nodes.h"
#include "daemon_notify.h"
#include "daemon_stats.h"
#include "whisker_protocol.h"

#define BRIDGE "bridge"
#define POLL_MS 100
/* How often readers are told clock mapping and statistics. */
#define TELL_MS 250
/* After a stop the bridge sends its last frame within a tick; a simulated one takes as long as its machine needs. */
#define DRAIN_MS 10000
/* A daemon that is to be replaced drains its bridge first. */
#define REPLACE_MS (DRAIN_MS + 5000)
#define REPLACE_LOOK_MS 20

struct daemon {
    const struct daemon_options *options;
    struct whisker_device *device; /* NULL: waiting for one */
    struct whisker_ring *ring;
    struct whisker_decoder decoder;
    struct whisker_clock_fit clock;
    struct daemon_stats stats;
    int64_t tell_at_ms;
    int64_t lost_at_ms;
    int told;  /* why a bridge could not be opened, as last logged */
    int ended; /* how the last stream ended */
    bool last_seen;
    bool damage_told;
};

static volatile sig_atomic_t report_wanted, nodes_wanted;

static void on_request(int number)
{
    if (number == SIGUSR1) {
        report_wanted = 1;
    } else {
        nodes_wanted = 1;
    }
}

static void catch_requests(void)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_request;
    sigaction(SIGUSR1, &action, NULL);
    sigaction(SIGUSR2, &action, NULL);
}

static int64_t clock_ns(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static int64_t now_ms(void)
{
    return clock_ns(CLOCK_MONOTONIC) / 1000000;
}

/* --------------------------------------------------------------------------------------------------------- the stream
 */

static void map_clock(struct daemon *daemon, const struct whisker_frame *newest)
{
    const int error =
        whisker_clock_add(&daemon->clock, newest->time_cycles, clock_ns(CLOCK_MONOTONIC), clock_ns(CLOCK_REALTIME));
    if (error) {
        daemon_log_error(LOG_WARN, "clock", error);
    }
}

static void on_bytes(void *context, const uint8_t *bytes, size_t count)
{
    struct daemon *daemon = context;
    const struct whisker_frame *frames;
    size_t made;
    if (whisker_ring_feed(daemon->ring, &daemon->decoder, bytes, count, &frames, &made) == 0 && made > 0) {
        daemon->last_seen |= (frames[made - 1].flags & WHISKER_FRAME_LAST) != 0;
        daemon_stats_frames(&daemon->stats, frames, made);
        map_clock(daemon, &frames[made - 1]);
    }
}

/* USB guards every packet by a CRC of its own, so a malformed frame is a fault of the bridge: said once, and again in
 * the exit code, while the other frames go on. */
static void tell_damage(struct daemon *daemon)
{
    const struct whisker_decoder *decoder = &daemon->decoder;
    if (decoder->first_error && !daemon->damage_told) {
        daemon_log(LOG_ERROR, BRIDGE ": after frame %llu: %s; %s", (unsigned long long)decoder->counts.frames,
                   whisker_error_text(decoder->first_error), whisker_error_remedy(decoder->first_error));
        daemon->damage_told = true;
    }
}

static void tell_readers(struct daemon *daemon)
{
    struct whisker_clock clock;
    daemon_stats_settle(&daemon->stats, &daemon->decoder.counts, &daemon->clock);
    whisker_clock_get(&daemon->clock, &clock);
    whisker_ring_set_clock(daemon->ring, &clock);
    whisker_ring_set_stats(daemon->ring, &daemon->stats.told);
}

/* What is due beside the frames, now and then. */
static void keep_house(struct daemon *daemon)
{
    daemon_notify_alive();
    tell_damage(daemon);
    const int64_t left_ms = daemon->tell_at_ms - now_ms();
    if (left_ms <= 0 || left_ms > TELL_MS) { /* more: the clock went back */
        daemon->tell_at_ms = now_ms() + TELL_MS;
        tell_readers(daemon);
    }
    if (report_wanted) {
        report_wanted = 0;
        tell_readers(daemon);
        daemon_stats_log(&daemon->stats.told);
    }
    if (nodes_wanted && daemon->device) {
        nodes_wanted = 0;
        daemon_nodes_log(daemon->device, daemon->options->settings.lane_mask);
    }
}

/* Receives what the bridge still sends after a stop, up to its last frame. */
static int drain(struct daemon *daemon)
{
    const int64_t give_up_ms = now_ms() + DRAIN_MS;
    int error = whisker_device_stop(daemon->device);
    while (!error && !daemon->last_seen && now_ms() < give_up_ms) {
        error = whisker_device_poll(daemon->device, POLL_MS);
    }
    whisker_device_flush(daemon->device);
    return !error && !daemon->last_seen ? WHISKER_ERROR_DEVICE_DRAIN : error;
}

/* Returns 0 when told to stop and all is received, or why the stream has ended. */
static int stream(struct daemon *daemon)
{
    int error = WHISKER_OK;
    while (!error && !cli_stop_wanted()) {
        error = whisker_device_poll(daemon->device, POLL_MS);
        keep_house(daemon);
    }
    return error ? error : drain(daemon);
}

/* --------------------------------------------------------------------------------------------------------- the bridge
 */

/* A new stream: the counts stay, half a frame from before does not; readers are told that something is missing. */
static void begin_stream(struct daemon *daemon, bool first)
{
    struct whisker_decoder *decoder = &daemon->decoder;
    whisker_decoder_end(decoder);
    const struct whisker_decoder_counts counts = decoder->counts;
    whisker_decoder_init(decoder);
    decoder->counts = counts;
    decoder->mark = first ? 0 : WHISKER_FRAME_GAP;
    daemon->last_seen = false;
}

/* Opens the bridge and starts it; on an error nothing stays open. */
static int connect_bridge(struct daemon *daemon, struct whisker_identity *identity)
{
    int error = whisker_device_open(daemon->options->serial, &daemon->device, identity);
    if (error) {
        return error;
    }
    daemon_stats_connected(&daemon->stats, whisker_device_about(daemon->device), identity);
    error = whisker_device_start(daemon->device, &daemon->options->settings, on_bytes, daemon);
    if (error) {
        daemon_stats_lost(&daemon->stats, error);
        whisker_device_close(daemon->device);
        daemon->device = NULL;
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

static void announce(struct daemon *daemon)
{
    const struct whisker_daemon_stats *told = &daemon->stats.told;
    char line[256];
    snprintf(line, sizeof line, "bridge %s (%s) at %s streams into ring %s", told->serial, told->firmware,
             whisker_device_about(daemon->device)->path, daemon->options->ring);
    tell_readers(daemon);
    daemon_log(LOG_DETAIL, "%s", line);
    daemon_notify_ready(line);
}

/* Tries once. True: it streams, or it is worth to wait for. Else the reason has been logged. */
static bool connect_first(struct daemon *daemon)
{
    struct whisker_identity identity;
    begin_stream(daemon, true);
    const int error = connect_bridge(daemon, &identity);
    if (!error) {
        announce(daemon);
        return true;
    }
    daemon_stats_lost(&daemon->stats, error);
    daemon->told = error;
    if (!daemon->options->wait) {
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
    begin_stream(daemon, first);
    const int error = connect_bridge(daemon, &identity);
    if (error) {
        daemon_stats_lost(&daemon->stats, error);
        if (error != daemon->told) {
            log_refusal(error, &identity);
        }
        daemon->told = error;
        return;
    }
    daemon->told = WHISKER_OK;
    daemon->stats.told.reconnects += !first;
    announce(daemon);
    if (!first) {
        daemon_log(LOG_NOTE, BRIDGE ": %s is back after %.1f s", daemon->stats.told.serial,
                   (double)(now_ms() - daemon->lost_at_ms) * 1e-3);
    }
}

/* Waits for a bridge, or for the wish to stop. Returns 0 or why it cannot even wait. */
static int await_bridge(struct daemon *daemon)
{
    struct whisker_hotplug *hotplug;
    const int error = whisker_hotplug_open(&hotplug);
    while (!error && !daemon->device && !cli_stop_wanted()) {
        keep_house(daemon);
        if (whisker_hotplug_wait(hotplug, POLL_MS) == WHISKER_OK) {
            connect_again(daemon);
        }
    }
    whisker_hotplug_close(hotplug);
    return error;
}

static void lose_bridge(struct daemon *daemon, int error)
{
    daemon->lost_at_ms = now_ms();
    daemon->told = error;
    whisker_device_close(daemon->device); /* publishes what had come */
    daemon->device = NULL;
    daemon_stats_lost(&daemon->stats, error);
    tell_readers(daemon);
    daemon_log_error(LOG_WARN, BRIDGE, error);
    daemon_notify_ready("the bridge has gone; waiting for it");
}

/* Streams and waits in turn. Returns 0 when told to stop, or why it cannot go on. */
static int serve(struct daemon *daemon)
{
    while (!cli_stop_wanted()) {
        const int error = daemon->device ? stream(daemon) : await_bridge(daemon);
        if (!error) {
            continue;
        }
        if (!daemon->device || daemon->options->once || cli_stop_wanted()) {
            daemon_log_error(LOG_ERROR, BRIDGE, error);
            return error;
        }
        lose_bridge(daemon, error);
    }
    return WHISKER_OK;
}

/* ----------------------------------------------------------------------------------------------------------- the ring
 */

/* Tells the writer of the ring to stop. The ring's lock says that it lives, so the number is its own. */
static bool stop_writer(const char *name)
{
    struct whisker_reader *reader;
    struct whisker_reader_info info;
    if (whisker_reader_attach(name, 0, &reader) != WHISKER_OK) {
        return false;
    }
    whisker_reader_info(reader, &info);
    whisker_reader_detach(reader);
    return info.writer_pid > 1 && kill((pid_t)info.writer_pid, SIGTERM) == 0;
}

static int make_ring(struct daemon *daemon)
{
    const struct daemon_options *options = daemon->options;
    int error = whisker_ring_create(options->ring, options->frames, &daemon->ring);
    const int64_t give_up_ms = now_ms() + REPLACE_MS;
    if (error == WHISKER_ERROR_RING_BUSY && options->replace && stop_writer(options->ring)) {
        while (error == WHISKER_ERROR_RING_BUSY && now_ms() < give_up_ms && !cli_stop_wanted()) {
            nanosleep(&(struct timespec){.tv_nsec = REPLACE_LOOK_MS * 1000000L}, NULL);
            error = whisker_ring_create(options->ring, options->frames, &daemon->ring);
        }
    }
    return error;
}

static void end(struct daemon *daemon)
{
    daemon_notify_stopping();
    whisker_decoder_end(&daemon->decoder);
    tell_damage(daemon);
    tell_readers(daemon);
    if (daemon->stats.told.connected_ns != 0) {
        daemon_stats_log(&daemon->stats.told);
    }
    whisker_device_close(daemon->device);
    whisker_ring_close(daemon->ring);
}

int daemon_run(const struct daemon_options *options)
{
    struct daemon daemon = {.options = options};
    catch_requests();
    const int error = make_ring(&daemon);
    if (error) {
        daemon_log_error(LOG_ERROR, options->ring, error);
        return CLI_FAILED;
    }
    whisker_decoder_init(&daemon.decoder);
    whisker_clock_begin(&daemon.clock, WHISKER_LIMIT_CLOCK_HZ, whisker_settings_latency_ns(&options->settings));
    daemon_stats_begin(&daemon.stats, &options->settings);
    const bool failed = !connect_first(&daemon) || serve(&daemon) != WHISKER_OK;
    end(&daemon);
    return failed || daemon.damage_told ? CLI_FAILED : CLI_OK;
}
