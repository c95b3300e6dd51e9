#include "whisker_base_robot.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

#include "create/port.h"

#define READ_BYTES 256
#define COMMANDER_FRAMES (BASE_COMMANDER_MS / CREATE_OI_PERIOD_MS)
static const uint8_t packets[] = {
    CREATE_OI_BUMPS_DROPS,
    CREATE_OI_CLIFF_LEFT,
    CREATE_OI_CLIFF_FRONT_LEFT,
    CREATE_OI_CLIFF_FRONT_RIGHT,
    CREATE_OI_CLIFF_RIGHT,
    CREATE_OI_DISTANCE,
    CREATE_OI_ANGLE,
    CREATE_OI_VOLTAGE,
    CREATE_OI_CHARGE,
    CREATE_OI_CAPACITY,
    CREATE_OI_CHARGING_SOURCES,
    CREATE_OI_MODE,
    CREATE_OI_REQUESTED_RIGHT,
    CREATE_OI_REQUESTED_LEFT,
    CREATE_OI_ENCODER_LEFT,
    CREATE_OI_ENCODER_RIGHT,
};
enum { ENCODERS = 2 }; /* the last two: Create 2 only */

static size_t whisker_base_robot_packet_count(const struct base_robot *robot)
{
    return sizeof packets - (robot->options->odometry.model == CREATE_2 ? 0 : ENCODERS);
}

/* ---------------------------------------------------------------------------------------------------------- the line
 */

static void whisker_base_robot_lose(struct base_robot *robot, const char *doing)
{
    base_log(&robot->log.line, LOG_WARN, "%s: %s: %s; plug it in again", robot->options->port, doing, strerror(errno));
    close(robot->port);
    robot->port = -1;
    robot->sent = 0;
    robot->speeds = (struct create_speeds){0};
}

static bool whisker_base_robot_order(struct base_robot *robot, const uint8_t *bytes, size_t count)
{
    if (robot->port < 0) {
        return false;
    }
    if (!create_port_write(robot->port, bytes, count)) {
        whisker_base_robot_lose(robot, "cannot write");
        return false;
    }
    robot->sent += count;
    return true;
}

static bool whisker_base_robot_order_opcode(struct base_robot *robot, enum create_oi_opcode opcode)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    return whisker_base_robot_order(robot, bytes, create_put_opcode(bytes, opcode));
}

static bool whisker_base_robot_ask_mode(struct base_robot *robot, enum create_oi_mode mode)
{
    robot->entered = false;
    robot->frames_since_mode = 0;
    robot->wanted = mode;
    return mode == CREATE_OI_MODE_PASSIVE
               ? whisker_base_robot_order_opcode(robot, CREATE_OI_OP_START)
               : whisker_base_robot_order_opcode(robot,
                                                 mode == CREATE_OI_MODE_FULL ? CREATE_OI_OP_FULL : CREATE_OI_OP_SAFE);
}

/* Orders the wheels, by a command of so many bytes. A base that is not heard goes by its new speeds from now on. */
static bool whisker_base_robot_order_wheels(struct base_robot *robot, const uint8_t *bytes, size_t count,
                                            struct create_speeds speeds, int64_t now_ms)
{
    const struct create_speeds before = robot->speeds;
    const bool ordered = whisker_base_robot_order(robot, bytes, count);
    if (ordered && (speeds.left_mm_s != before.left_mm_s || speeds.right_mm_s != before.right_mm_s)) {
        robot->changed_ms = now_ms;
    }
    robot->speeds = ordered ? speeds : (struct create_speeds){0};
    return ordered;
}

static bool whisker_base_robot_order_speeds(struct base_robot *robot, struct create_speeds speeds, int64_t now_ms)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    return whisker_base_robot_order_wheels(
        robot, bytes, create_put_drive_direct(bytes, speeds.right_mm_s, speeds.left_mm_s), speeds, now_ms);
}

/* Wheels first, then who commands, then what is reported. arm: enter the wanted mode. */
static bool whisker_base_robot_start_base(struct base_robot *robot, bool arm, int64_t now_ms)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    return whisker_base_robot_order_wheels(robot, bytes, create_put_stop(bytes), (struct create_speeds){0}, now_ms) &&
           whisker_base_robot_order_opcode(robot, CREATE_OI_OP_START) &&
           (!arm || whisker_base_robot_ask_mode(robot, robot->wanted)) &&
           whisker_base_robot_order(robot, bytes,
                                    create_put_stream(bytes, packets, whisker_base_robot_packet_count(robot)));
}

static void whisker_base_robot_add_counts(struct create_stream_counts *sum, const struct create_stream_counts *counts)
{
    sum->bytes += counts->bytes;
    sum->frames += counts->frames;
    sum->corrupt += counts->corrupt;
    sum->skipped += counts->skipped;
    sum->resyncs += counts->resyncs;
}

static const char *whisker_base_robot_remedy(int error)
{
    switch (error) {
    case ENOENT:
        return "there is no such port; plug the adapter in, or look in /dev/serial/by-id for its name";
    case EACCES:
        return "no permission; join its group: sudo adduser $USER dialout, then log in again";
    case EWOULDBLOCK:
        return "another process drives it; stop that";
    case ENOTTY:
        return "it is no serial port; choose another";
    default:
        return strerror(error);
    }
}

void base_robot_begin(struct base_robot *robot, const struct base_options *options, base_on_step *on_step,
                      void *context)
{
    *robot = (struct base_robot){.options = options, .on_step = on_step, .context = context, .port = -1};
    robot->wanted = options->full ? CREATE_OI_MODE_FULL : CREATE_OI_MODE_SAFE;
    create_odometry_begin(&robot->odometry, &options->odometry);
}

bool base_robot_open(struct base_robot *robot, int port, int64_t now_ms)
{
    robot->port = port >= 0 ? port : create_port_open(robot->options->port, robot->options->baud);
    if (robot->port < 0) {
        if (errno != robot->error) {
            robot->error = errno;
            daemon_log(LOG_ERROR, "%s: %s", robot->options->port, whisker_base_robot_remedy(errno));
        }
        return false;
    }
    robot->error = 0;
    robot->sent = 0;
    robot->silent = false;
    robot->opened_ms = now_ms;
    whisker_base_robot_add_counts(&robot->past, &robot->stream.counts);
    create_stream_begin(&robot->stream, packets, whisker_base_robot_packet_count(robot));
    daemon_log(LOG_DETAIL, "%s: open, %s at %u baud", robot->options->port,
               create_model_facts(robot->options->odometry.model)->name, robot->options->baud);
    return whisker_base_robot_start_base(robot, true, now_ms);
}

uint64_t base_robot_frames(const struct base_robot *robot)
{
    return robot->past.frames + robot->stream.counts.frames + robot->missed;
}

uint64_t base_robot_taken(const struct base_robot *robot)
{
    return robot->stream.counts.bytes;
}

/* --------------------------------------------------------------------------------------------------------- the frames
 */

static void whisker_base_robot_stop_commander(struct base_robot *robot, int64_t now_ms)
{
    robot->commander_stops++;
    base_log(&robot->log.commander, LOG_WARN, "the commander is silent; wheels stopped");
    base_robot_stop(robot, now_ms);
}

static bool whisker_base_robot_moving(const struct base_robot *robot)
{
    return robot->speeds.left_mm_s != 0 || robot->speeds.right_mm_s != 0;
}

/* Frames that time says are missing, beside those that the bytes show: the line was gone or silent. */
static uint32_t whisker_base_robot_frames_of_gap(const struct base_robot *robot, int64_t now_ms)
{
    const int64_t gap_ms = now_ms - robot->frame_ms;
    const bool gap = !robot->options->stream_clock && robot->frame_ms > 0 && gap_ms >= BASE_SILENCE_MS;
    return gap ? (uint32_t)(gap_ms / CREATE_OI_PERIOD_MS - 1) : 0;
}

/* Counts the missed frames since other speeds were ordered. */
static uint32_t whisker_base_robot_frames_since_change(const struct base_robot *robot, int64_t now_ms)
{
    const uint32_t since = (uint32_t)((now_ms - robot->changed_ms) / CREATE_OI_PERIOD_MS);
    return robot->changed_ms <= robot->frame_ms ? 0 : since < robot->frame.missed ? since : robot->frame.missed;
}

static void whisker_base_robot_log_back(struct base_robot *robot)
{
    if (robot->reported_ms > 0) {
        robot->reported_ms = 0;
        base_log(&robot->log.back, LOG_NOTE, "%s: frames come again", robot->options->port);
    }
}

static void whisker_base_robot_take_frame(struct base_robot *robot, int64_t now_ms)
{
    const uint32_t gap = whisker_base_robot_frames_of_gap(robot, now_ms);
    robot->frame.missed = gap > robot->frame.missed ? gap : robot->frame.missed;
    robot->frame.ordered = gap > 0 ? whisker_base_robot_frames_since_change(robot, now_ms) : 0;
    robot->missed += robot->frame.missed;
    robot->frame_ms = now_ms;
    robot->silent = false;
    whisker_base_robot_log_back(robot);
    const struct create_step step = create_odometry_take(&robot->odometry, &robot->frame);
    base_robot_handle_frame(robot);
    robot->on_step(robot->context, &step, base_robot_bits(robot));
    robot->frames_since_drive += 1 + robot->frame.missed;
    if (robot->options->stream_clock && whisker_base_robot_moving(robot) &&
        robot->frames_since_drive >= COMMANDER_FRAMES) {
        whisker_base_robot_stop_commander(robot, now_ms);
    }
}

bool base_robot_read(struct base_robot *robot, uint64_t limit, int64_t now_ms)
{
    uint8_t bytes[READ_BYTES];
    const uint64_t left = limit - base_robot_taken(robot);
    const int got = create_port_read(robot->port, bytes, left < sizeof bytes ? (size_t)left : sizeof bytes);
    if (got < 0) {
        whisker_base_robot_lose(robot, "the line is gone");
        return false;
    }
    for (int i = 0; i < got; i++) {
        if (create_stream_push(&robot->stream, bytes[i], &robot->frame)) {
            whisker_base_robot_take_frame(robot, now_ms);
        }
    }
    return robot->port >= 0;
}

/* --------------------------------------------------------------------------------------------------------- the orders
 */

bool base_robot_drive(struct base_robot *robot, double v_m_s, double omega_rad_s, int64_t now_ms)
{
    const struct create_odometry_settings *settings = &robot->options->odometry;
    robot->drive_ms = now_ms;
    robot->frames_since_drive = 0;
    const struct create_speeds wanted =
        base_robot_kept(robot) ? (struct create_speeds){0}
                               : create_choose_speeds(settings->model, settings->wheel_base_m, v_m_s, omega_rad_s);
    return whisker_base_robot_order_speeds(robot, wanted, now_ms);
}

bool base_robot_stop(struct base_robot *robot, int64_t now_ms)
{
    return whisker_base_robot_order_speeds(robot, (struct create_speeds){0}, now_ms);
}

static void whisker_base_robot_log_hold(struct base_robot *robot, enum base_hold reason, bool on)
{
    const bool heartbeat = reason == BASE_HOLD_HEARTBEAT;
    if (on) {
        base_log(&robot->log.hold, heartbeat ? LOG_ERROR : LOG_NOTE, "%s; wheels stopped",
                 heartbeat ? "no heartbeat: the guard or the supervisor hangs"
                           : "the machine is about to sleep or to be shut down");
    } else {
        base_log(&robot->log.hold, LOG_NOTE, "%s; the commander may drive again",
                 heartbeat ? "the heartbeat is back" : "the machine is awake");
    }
}

void base_robot_hold(struct base_robot *robot, enum base_hold reason, bool on, int64_t now_ms)
{
    if (((robot->held & reason) != 0) == on) {
        return;
    }
    robot->held ^= reason;
    if (on) {
        base_robot_stop(robot, now_ms);
    }
    whisker_base_robot_log_hold(robot, reason, on);
}

bool base_robot_mode(struct base_robot *robot, enum create_oi_mode mode, int64_t now_ms)
{
    return base_robot_stop(robot, now_ms) && whisker_base_robot_ask_mode(robot, mode);
}

/* A line that stays silent is reported once, and then every hour. */
static void whisker_base_robot_log_silence(struct base_robot *robot, int64_t now_ms)
{
    if (robot->reported_ms == 0 || now_ms - robot->reported_ms >= BASE_TELL_MS) {
        robot->reported_ms = now_ms;
        base_log(&robot->log.silence, LOG_WARN,
                 "%s: no frame for %d ms; wheels stopped, stream asked for again every %d ms; check cable, --baud and "
                 "battery",
                 robot->options->port, BASE_SILENCE_MS, BASE_SILENCE_MS);
    }
}

/* Bytes have stopped: stopped wheels are all that can be had without seeing. The mode is entered again only if the base
 * was in it: a base that left it by itself waits for the commander. */
static void whisker_base_robot_restart_stream(struct base_robot *robot, int64_t now_ms)
{
    robot->silences++;
    robot->silent = robot->stream.counts.frames > 0;
    robot->opened_ms = now_ms;
    whisker_base_robot_log_silence(robot, now_ms);
    whisker_base_robot_start_base(robot, robot->entered || robot->stream.counts.frames == 0, now_ms);
}

int base_robot_watch(struct base_robot *robot, int64_t now_ms)
{
    if (robot->options->stream_clock || robot->port < 0) {
        return BASE_REOPEN_MS;
    }
    if (whisker_base_robot_moving(robot) && now_ms - robot->drive_ms >= BASE_COMMANDER_MS) {
        whisker_base_robot_stop_commander(robot, now_ms);
    }
    const int64_t heard_ms = robot->frame_ms > robot->opened_ms ? robot->frame_ms : robot->opened_ms;
    if (now_ms - heard_ms >= BASE_SILENCE_MS) {
        whisker_base_robot_restart_stream(robot, now_ms);
        return BASE_SILENCE_MS;
    }
    const int64_t silence_ms = heard_ms + BASE_SILENCE_MS - now_ms;
    const int64_t commander_ms =
        whisker_base_robot_moving(robot) ? robot->drive_ms + BASE_COMMANDER_MS - now_ms : silence_ms;
    return (int)(commander_ms < silence_ms ? commander_ms : silence_ms);
}

void base_robot_end(struct base_robot *robot, int64_t now_ms)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    if (base_robot_stop(robot, now_ms) && whisker_base_robot_order(robot, bytes, create_put_pause(bytes)) &&
        whisker_base_robot_order_opcode(robot, CREATE_OI_OP_START)) {
        close(robot->port);
    }
    robot->port = -1;
}
