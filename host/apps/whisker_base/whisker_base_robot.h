/*
 * The base as its driver sees it: port, stream, odometry, orders, and what makes wheels stop.
 *
 * Nothing here waits. Times are CLOCK_MONOTONIC in ms, given by the caller. After base_robot_begin() no memory is
 * allocated.
 */
#ifndef WHISKER_BASE_ROBOT_H
#define WHISKER_BASE_ROBOT_H

#include "create/command.h"
#include "create/odometry.h"
#include "create/stream.h"
#include "whisker_base_log.h"
#include "whisker_base_options.h"

/* A commander silent for so long is taken for gone; without a frame for so long the stream is restarted. */
#define BASE_COMMANDER_MS 300
#define BASE_SILENCE_MS 500
#define BASE_REOPEN_MS 50
/* A base that stays silent is reported so often. */
#define BASE_TELL_MS 3600000

/* Why the wheels are kept stopped, whatever the commander says: bits. */
enum base_hold {
    BASE_HOLD_HEARTBEAT = 1, /* guard or supervisor hang */
    BASE_HOLD_SLEEP = 2      /* the machine goes to sleep or is shut down */
};

/* Bits reported with the odometry: 0 to 4 are packet 7's (bumps, wheel drops). */
enum {
    BASE_CLIFF_LEFT = 1 << 5,
    BASE_CLIFF_FRONT_LEFT = 1 << 6,
    BASE_CLIFF_FRONT_RIGHT = 1 << 7,
    BASE_CLIFF_RIGHT = 1 << 8,
    BASE_IDLE = 1 << 9 /* wheels will not turn: the base has left its mode, is not connected, or is held */
};

/* Receives every frame's motion. */
typedef void base_on_step(void *context, const struct create_step *step, unsigned bits);

struct base_robot {
    const struct base_options *options;
    base_on_step *on_step;
    void *context;
    int port;      /* -1: none */
    uint64_t sent; /* bytes written to this connection */
    struct create_stream stream;
    struct create_stream_counts past; /* of earlier connections */
    struct create_odometry odometry;
    struct create_frame frame;   /* newest */
    struct create_speeds speeds; /* ordered last */
    enum create_oi_mode wanted;
    int32_t mode_offset; /* some firmwares report a mode one higher than it is */
    uint32_t frames_since_mode;
    bool entered;           /* the wanted mode was seen in force since it was last asked for */
    bool low, reported_low; /* battery */
    bool silent;            /* it was heard, and then no more: until a frame comes the wheels stay stopped */
    unsigned held;          /* bits of enum base_hold: while one is set the wheels stay stopped */
    int64_t drive_ms, frame_ms, opened_ms;
    int64_t reported_ms; /* when a silence was logged that still lasts; 0: none does */
    int64_t changed_ms;  /* when other speeds than before were ordered */
    uint32_t frames_since_drive;
    int error; /* why the port could not be opened, as last reported */
    uint64_t reconnects, silences, commander_stops, mode_losses, missed;
    struct {
        struct base_log_limit line, silence, back, commander, hold, mode;
    } log;
};

void base_robot_begin(struct base_robot *robot, const struct base_options *options, base_on_step *on_step,
                      void *context);

/* Opens the port, or takes `port` when it is not negative, and starts the base: stopped, mode, stream. False: no port.
 */
bool base_robot_open(struct base_robot *robot, int port, int64_t now_ms);

/* Reads what has come, up to byte `limit` of this connection. False: the line is gone, and closed. */
bool base_robot_read(struct base_robot *robot, uint64_t limit, int64_t now_ms);

/* Frames since the driver began, those that never came among them: the stream's clock. */
uint64_t base_robot_frames(const struct base_robot *robot);

/* Bytes of this connection taken in. */
uint64_t base_robot_taken(const struct base_robot *robot);

/* Orders the wheels; false: there is no line. Speeds really ordered: robot->speeds. */
bool base_robot_drive(struct base_robot *robot, double v_m_s, double omega_rad_s, int64_t now_ms);
bool base_robot_stop(struct base_robot *robot, int64_t now_ms);

/* Stops the wheels and keeps them so for this reason, or takes the reason back. */
void base_robot_hold(struct base_robot *robot, enum base_hold reason, bool on, int64_t now_ms);

/* Whether the wheels are kept stopped, whatever is ordered: no port, a silent base, or held. */
bool base_robot_kept(const struct base_robot *robot);

/* Enters a mode, stopped; passive lets go. */
bool base_robot_mode(struct base_robot *robot, enum create_oi_mode mode, int64_t now_ms);

/* What time brings: stops wheels whose commander is silent, restarts a silent stream. Returns ms until the next is due.
 */
int base_robot_watch(struct base_robot *robot, int64_t now_ms);

/* Stopped, stream paused, passive; closed. */
void base_robot_end(struct base_robot *robot, int64_t now_ms);

/* One line of key=value, for people and programs. */
void base_robot_health(const struct base_robot *robot, char *text, size_t room);

/* Mode of the newest frame, as of enum create_oi_mode. */
int32_t base_robot_mode_reported(const struct base_robot *robot);

/* Takes note of mode and battery in a new frame, and says once what a person should know. */
void base_robot_handle_frame(struct base_robot *robot);

/* Bits of the newest frame. */
unsigned base_robot_bits(const struct base_robot *robot);

#endif
