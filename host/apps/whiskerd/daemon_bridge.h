/* The bridge of the daemon: opened, started, lost and tried again; what it sends goes to the stream. */
#ifndef WHISKER_DAEMON_BRIDGE_H
#define WHISKER_DAEMON_BRIDGE_H

#include "daemon_stats.h"

/* The daemon looks about so often. */
#define DAEMON_POLL_MS 100

#define DAEMON_BRIDGE "bridge" /* in the log */

struct daemon_bridge {
    const char *serial; /* NULL: any */
    struct whisker_settings settings;
    struct whisker_device *device; /* NULL: waiting for it */
    struct daemon_source source;
    struct whisker_timing ticks; /* of tick_in, when last asked for */
    uint32_t ticks_reported;     /* bit n: error TICK_IN_SILENT - n of this run is in the log */
    int64_t lost_at_ms;
    int logged;     /* why it could not be opened, as last logged */
    bool last_seen; /* the last frame after a stop has come */
    bool damage_reported;
    bool dated; /* its frames say when they were by the host's start-of-frame packets */
};

/* Opens and starts it, with `sink` for what it sends. Returns 0, or why not; then nothing stays open. */
int daemon_bridge_connect(struct daemon_bridge *bridge, struct daemon_stats *stats, whisker_sink sink, void *context,
                          struct whisker_identity *identity);

/* Logs why it could not be opened. */
void daemon_bridge_log_refusal(int error, const struct whisker_identity *identity);

/* It has gone, for this reason; what had come is published. */
void daemon_bridge_lose(struct daemon_bridge *bridge, struct daemon_stats *stats, int error);

/* Asks for the report `timing`, if it is of use: for the clock, and for what is wrong with the pin that the ticks come
 * from, each kind of which is logged once in a run, with the counts. */
void daemon_bridge_look_at_ticks(struct daemon_bridge *bridge, struct whisker_clock_fit *clock);

/* USB guards every packet by a CRC of its own, so a malformed frame is a fault of the bridge: said once, while the
 * other frames go on. */
void daemon_bridge_report_damage(struct daemon_bridge *bridge);

#endif
