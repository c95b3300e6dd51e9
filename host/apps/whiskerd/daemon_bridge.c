#include "daemon_bridge.h"

#include "cli.h"
#include "daemon_log.h"
#include "whisker_protocol.h"

/* Half a frame from before does not stay; a mark for readers says that something is missing, but at the first start. */
static void daemon_bridge_begin(struct daemon_bridge *bridge)
{
    struct whisker_decoder *decoder = &bridge->source.decoder;
    whisker_decoder_end(decoder);
    const struct whisker_decoder_counts counts = decoder->counts;
    whisker_decoder_init(decoder);
    decoder->counts = counts;
    decoder->mark = bridge->lost_at_ms == 0 ? 0 : WHISKER_FRAME_GAP;
    bridge->ticks = (struct whisker_timing){0};
    bridge->ticks_reported = 0;
    bridge->last_seen = bridge->dated = false;
}

int daemon_bridge_connect(struct daemon_bridge *bridge, struct daemon_stats *stats, whisker_sink sink, void *context,
                          struct whisker_identity *identity)
{
    daemon_bridge_begin(bridge);
    int error = whisker_device_open(bridge->serial, &bridge->device, identity);
    if (error) {
        return error;
    }
    daemon_stats_connected(stats, &bridge->source, whisker_device_about(bridge->device), identity);
    error = whisker_device_start(bridge->device, &bridge->settings, sink, context);
    if (error) {
        daemon_stats_lost(stats, true, error);
        whisker_device_close(bridge->device);
        bridge->device = NULL;
    }
    return error;
}

void daemon_bridge_log_refusal(int error, const struct whisker_identity *identity)
{
    if (error == WHISKER_ERROR_WIRE_VERSION) {
        daemon_log(LOG_ERROR, DAEMON_BRIDGE ": %s (bridge %u, host %d); %s", whisker_error_text(error),
                   identity->wire_version, whisker_wire_version(), whisker_error_remedy(error));
    } else {
        daemon_log_error(LOG_ERROR, DAEMON_BRIDGE, error);
    }
}

void daemon_bridge_lose(struct daemon_bridge *bridge, struct daemon_stats *stats, int error)
{
    bridge->lost_at_ms = cli_now_ms();
    bridge->logged = error;
    whisker_device_close(bridge->device);
    bridge->device = NULL;
    daemon_stats_lost(stats, true, error);
    daemon_log_error(LOG_WARN, DAEMON_BRIDGE, error);
}

static void daemon_bridge_report_ticks(struct daemon_bridge *bridge, const struct whisker_timing *now)
{
    const int error = whisker_timing_judge(&bridge->ticks, now);
    const uint32_t bit = error ? UINT32_C(1) << (WHISKER_ERROR_TICK_IN_SILENT - error) : 0;
    bridge->ticks = *now;
    if (bit & ~bridge->ticks_reported) {
        bridge->ticks_reported |= bit;
        daemon_log_error(LOG_WARN, "tick_in", error);
        daemon_log(LOG_NOTE,
                   DAEMON_BRIDGE
                   ", tick_in: %u edges taken, %u early, %u uneven, %u silences; shortest distance %u cycles",
                   now->edges, now->early, now->uneven, now->silent, now->shortest);
    }
}

/* The report counts ticks in 32 bits. */
static uint64_t daemon_bridge_cycles(const struct daemon_bridge *bridge, uint32_t tick)
{
    const uint64_t latest = bridge->source.decoder.tick;
    return (latest + (uint64_t)(int64_t)(int32_t)(tick - (uint32_t)latest)) * bridge->settings.tick_period;
}

void daemon_bridge_look_at_ticks(struct daemon_bridge *bridge, struct whisker_clock_fit *clock)
{
    struct whisker_timing now;
    const bool from_pin = bridge->settings.options & WHISKER_OPTION_TICK_IN;
    if (!bridge->device || !(from_pin || bridge->dated) || whisker_device_timing(bridge->device, &now) != WHISKER_OK) {
        return;
    }
    if (bridge->dated) {
        whisker_clock_report(clock, daemon_bridge_cycles(bridge, now.tick), now.usb_time, now.sof_cycles);
    }
    if (from_pin) {
        daemon_bridge_report_ticks(bridge, &now);
    }
}

void daemon_bridge_report_damage(struct daemon_bridge *bridge)
{
    const struct whisker_decoder *decoder = &bridge->source.decoder;
    if (decoder->first_error && !bridge->damage_reported) {
        daemon_log(LOG_ERROR, DAEMON_BRIDGE ": after frame %llu: %s; %s", (unsigned long long)decoder->counts.frames,
                   whisker_error_text(decoder->first_error), whisker_error_remedy(decoder->first_error));
        bridge->damage_reported = true;
    }
}
