#include "whisker_base_robot.h"

#include <errno.h>
#include <math.h>
#include <string.h>

#include "create/port.h"
#include "whisker_base_orders.h"

/* Read in one turn at most: more than a terminal holds, so that the newest frame is known before an order is obeyed. */
#define READ_BYTES 4096
#define READS 16
/* Adapters hold bytes back for up to 16 ms: so late a frame may be and none be missing before it. */
#define LATE_MS (2 * CREATE_OI_PERIOD_MS)
/* The base's clock and this one differ by less than 1 %. */
#define CLOCK_SHARE 0.01
#define COMMANDER_FRAMES (BASE_COMMANDER_MS / CREATE_OI_PERIOD_MS)
/* Frames of an earlier request that may still be on their way. */
#define OWN_FRAMES 5
/* From a request to the frame it asks for: both on the line, the period, what an adapter holds back. */
#define ANSWER_MS (4 * CREATE_OI_PERIOD_MS)
/* A base that is heard no more, though bytes come: its line may have another speed, where a stop takes so much longer
 * that it cannot wait for the end of a silence. */
#define ASTRAY_MS (5 * CREATE_OI_PERIOD_MS)
#define BOOT_BYTE 0xfe /* of a boot loader that starts again and again, in reports of users */

/* ---------------------------------------------------------------------------------------------------------- the line
 */

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
    case EBUSY:
        return "another process drives it or has it for itself, as a terminal program or ModemManager; end that";
    case ENOTTY:
        return "it is no serial port; choose another";
    default:
        return strerror(error);
    }
}

/* The mode that nobody has to ask for. */
static enum create_oi_mode whisker_base_robot_own_mode(const struct base_robot *robot)
{
    return robot->options->full ? CREATE_OI_MODE_FULL : CREATE_OI_MODE_SAFE;
}

void base_robot_begin(struct base_robot *robot, const struct base_options *options, base_on_step *on_step,
                      void *context)
{
    *robot = (struct base_robot){.options = options, .on_step = on_step, .context = context, .port = -1};
    robot->wanted = whisker_base_robot_own_mode(robot);
    robot->phase = BASE_RESTING;
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
    create_port_forget(robot->port); /* what was said before is not believed */
    robot->error = 0;
    robot->sent = 0;
    robot->silent = robot->recalled = robot->repeated = false;
    robot->recalls = 0;
    robot->unseen = robot->frame_ms > 0;
    robot->low_brc = -1;
    robot->requests += robot->options->stream_clock ? 0 : (unsigned)now_ms; /* a driver before had orders of its own */
    robot->emptied_ms = now_ms;
    robot->phase_frames = 0;
    whisker_base_robot_add_counts(&robot->past, &robot->stream.counts);
    robot->stream = robot->before = (struct create_stream){0};
    robot->answered = false;
    robot->frame = (struct create_frame){0};
    daemon_log(LOG_DETAIL, "%s: open, %s at %u baud", robot->options->port,
               create_model_facts(robot->options->odometry.model)->name, robot->options->baud);
    robot->quiet_ms = now_ms;
    base_request(robot, now_ms);
    return robot->port >= 0;
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
    base_robot_stop(robot, now_ms);
    base_log(&robot->log.commander, LOG_WARN, "the commander is silent; %s", base_robot_fate(robot));
}

/* So many frames at once, and too few for the time since the one before: the line may have held them, and the base have
 * said nothing since. */
static void whisker_base_robot_note_heard(struct base_robot *robot, int64_t before_ms, int64_t frames, bool asked)
{
    const bool goes_on = robot->frame_ms - before_ms < CREATE_OI_PERIOD_MS / 2;
    const int64_t least_ms = (goes_on ? robot->heard_ms : before_ms) + frames * CREATE_OI_PERIOD_MS;
    if (frames > 0) {
        robot->heard_ms = robot->frame_ms - least_ms > LATE_MS ? least_ms : robot->frame_ms;
    }
    robot->quiet_ms = asked && robot->heard_ms > robot->quiet_ms ? robot->heard_ms : robot->quiet_ms;
}

static bool whisker_base_robot_moving(const struct base_robot *robot)
{
    return robot->speeds.left_mm_s != 0 || robot->speeds.right_mm_s != 0;
}

/* When a frame that is read now was said, at the latest: one each period since there was nothing more to read. */
static int64_t whisker_base_robot_date(const struct base_robot *robot, int64_t now_ms)
{
    const int64_t after_ms = robot->frame_ms > robot->emptied_ms ? robot->frame_ms : robot->emptied_ms;
    const int64_t said_ms = after_ms + CREATE_OI_PERIOD_MS;
    return robot->options->stream_clock || said_ms > now_ms ? now_ms : said_ms;
}

/* Holds a frame against the clock: how many are missing before it, or that it is one of those. A gap counts from
 * LATE_MS on; a shorter one if bytes were skipped as well. What came soonest shows when frames are due. */
static void whisker_base_robot_time_frame(struct base_robot *robot, int64_t said_ms)
{
    struct create_frame *frame = &robot->frame;
    const double due_ms = robot->schedule_ms + CREATE_OI_PERIOD_MS, behind_ms = (double)said_ms - due_ms;
    if (robot->options->stream_clock || robot->schedule_ms <= 0) {
        robot->schedule_ms = (double)said_ms;
        return;
    }
    const bool early = behind_ms < -0.5 * CREATE_OI_PERIOD_MS;
    if (early && robot->pending > 0) {
        robot->pending--;
        frame->timing = CREATE_LATE;
        frame->missed = 0;
        return;
    }
    const uint32_t passed = behind_ms > 0 ? (uint32_t)lround(behind_ms / CREATE_OI_PERIOD_MS) : 0;
    const uint32_t skipped = frame->missed < passed ? frame->missed : passed;
    frame->timing = early ? CREATE_SURPLUS : CREATE_IN_TIME;
    frame->missed = behind_ms >= LATE_MS ? passed : skipped;
    robot->pending = frame->missed - skipped;
    const double next_ms = due_ms + frame->missed * (double)CREATE_OI_PERIOD_MS;
    robot->schedule_ms = fmin((double)said_ms, next_ms + CLOCK_SHARE * CREATE_OI_PERIOD_MS);
}

static void whisker_base_robot_log_back(struct base_robot *robot)
{
    if (robot->reported_ms > 0) {
        robot->reported_ms = 0;
        base_log(&robot->log.back, LOG_NOTE, "%s: frames come again", robot->options->port);
    }
}

static void whisker_base_robot_log_carried(struct base_robot *robot)
{
    base_log(
        &robot->log.carried, LOG_WARN,
        "%s: the base says what its wheels cannot have done: it was carried, pushed or started anew, or the line is "
        "bad; taken for what was asked of it",
        robot->options->port);
}

/* The motion of the newest frame to all who want it. */
static void whisker_base_robot_step(struct base_robot *robot)
{
    const uint64_t carried = robot->odometry.carried;
    const bool counted = robot->odometry.started; /* by encoders, also while nobody heard it */
    robot->frame.unheard = robot->unseen;
    const struct create_step step = create_odometry_take(&robot->odometry, &robot->frame);
    const bool more = robot->odometry.carried > carried;
    const unsigned bits = base_robot_bits(robot), lifted = CREATE_OI_DROP_LEFT | CREATE_OI_DROP_RIGHT;
    const bool moved = more || (robot->unseen && !counted) || (bits & lifted) == lifted;
    robot->unseen = false;
    robot->on_step(robot->context, &step, bits | (moved ? BASE_CARRIED : 0u));
    if (more) {
        whisker_base_robot_log_carried(robot);
    }
}

static void whisker_base_robot_take_frame(struct base_robot *robot, int64_t now_ms)
{
    const int64_t said_ms = whisker_base_robot_date(robot, now_ms);
    whisker_base_robot_time_frame(robot, said_ms);
    robot->frame.ordered = base_orders_take(robot, said_ms);
    robot->missed += robot->frame.missed;
    robot->missed -= robot->frame.timing == CREATE_LATE;
    robot->frame_ms = said_ms;
    robot->silent = now_ms - said_ms >= BASE_SILENCE_MS;
    if (robot->answered) {
        robot->recalls = 0;
        robot->repeated = false;
        robot->unframed = (struct base_unframed){0};
        whisker_base_robot_log_back(robot);
    }
    base_robot_handle_frame(robot, now_ms);
    whisker_base_robot_step(robot);
    robot->frames_since_drive += 1 + robot->frame.missed;
    if (robot->options->stream_clock && whisker_base_robot_moving(robot) &&
        robot->frames_since_drive >= COMMANDER_FRAMES) {
        whisker_base_robot_stop_commander(robot, now_ms);
    }
}

/* A byte that may belong to no frame: what it looks like. */
static void whisker_base_robot_look_at(struct base_robot *robot, uint8_t byte)
{
    struct base_unframed *unframed = &robot->unframed;
    unframed->all++;
    unframed->text += (byte >= ' ' && byte <= '~') || byte == '\r' || byte == '\n';
    unframed->boot += byte == BOOT_BYTE;
    const bool length = unframed->before == CREATE_OI_STREAM_HEADER;
    unframed->own += length && byte == robot->stream.length - CREATE_OI_STREAM_OVERHEAD;
    unframed->other += length && byte == base_request_other_bytes(robot);
    unframed->before = byte;
}

bool base_robot_read(struct base_robot *robot, uint64_t limit, int64_t now_ms)
{
    uint8_t bytes[READ_BYTES];
    const int64_t before_ms = robot->frame_ms;
    int64_t frames = 0;
    bool any_asked = false;
    for (int reads = 0; reads < READS && robot->port >= 0; reads++) {
        const uint64_t left = limit - base_robot_taken(robot);
        const size_t room = left < sizeof bytes ? (size_t)left : sizeof bytes;
        const int got = create_port_read(robot->port, bytes, room);
        if (got < 0) {
            base_orders_lose(robot, "the line is gone");
            return false;
        }
        if (robot->unframed.all == 0) {
            robot->unframed.since_ms = now_ms;
        }
        robot->unframed.to_ms = got > 0 ? now_ms : robot->unframed.to_ms;
        for (int i = 0; i < got; i++) {
            whisker_base_robot_look_at(robot, bytes[i]);
            const bool asked = create_stream_push(&robot->stream, bytes[i], &robot->frame);
            robot->answered |= asked;
            any_asked |= asked;
            if (asked || (!robot->answered && robot->before.length > 0 &&
                          create_stream_push(&robot->before, bytes[i], &robot->frame))) {
                whisker_base_robot_take_frame(robot, now_ms);
                frames++;
            }
        }
        if ((size_t)got < sizeof bytes) {
            break;
        }
    }
    whisker_base_robot_note_heard(robot, before_ms, frames, any_asked);
    robot->emptied_ms = now_ms;
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
    base_orders_wheels(robot, wanted, now_ms);
    return robot->port >= 0 && !base_orders_may_turn(robot);
}

bool base_robot_stop(struct base_robot *robot, int64_t now_ms)
{
    base_orders_wheels(robot, (struct create_speeds){0}, now_ms);
    return robot->port >= 0 && !base_orders_may_turn(robot);
}

static void whisker_base_robot_log_hold(struct base_robot *robot, enum base_hold reason, bool on)
{
    const bool heartbeat = reason == BASE_HOLD_HEARTBEAT;
    if (on) {
        base_log(&robot->log.hold, heartbeat ? LOG_ERROR : LOG_NOTE, "%s; %s",
                 heartbeat ? "no heartbeat: the guard or the supervisor hangs"
                           : "the machine is about to sleep or to be shut down",
                 base_robot_fate(robot));
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
    const bool stopped = base_robot_stop(robot, now_ms);
    base_robot_ask_mode(robot, mode, now_ms);
    return stopped;
}

void base_robot_change_commander(struct base_robot *robot, bool taken, int64_t now_ms)
{
    const enum create_oi_mode own = whisker_base_robot_own_mode(robot);
    if (robot->wanted == own || (robot->wanted == CREATE_OI_MODE_PASSIVE && !taken)) {
        return;
    }
    if (robot->left) {
        robot->wanted = own;
    } else {
        base_robot_mode(robot, own, now_ms);
    }
}

/* What comes, for longer than from frame to frame, has neither text in it nor frames, but for one that was begun
 * before.
 */
static bool whisker_base_robot_astray(const struct base_unframed *unframed)
{
    return unframed->all > 0 && unframed->to_ms - unframed->since_ms >= LATE_MS && unframed->own <= 1 &&
           unframed->other == 0 && 2 * unframed->text <= unframed->all && 2 * unframed->boot <= unframed->all;
}

/* Why nothing is heard, by what has come since. */
static const char *whisker_base_robot_cause(const struct base_unframed *unframed)
{
    return unframed->own > OWN_FRAMES
               ? "it sends frames, but not those that it was asked for: it does not hear; check the wire to it"
           : unframed->all == 0 ? "nothing comes: it is off or asleep (press its power button), or the cable is out"
           : unframed->other > 0
               ? "it sends what the other model would; give --model 1 for a Create 1, --model 2 for a Create 2"
           : 2 * unframed->text > unframed->all
               ? "it sends text: it is starting, or rests on its charger; take it off that and switch it on"
           : 2 * unframed->boot > unframed->all ? "its boot loader starts again and again; charge its battery"
                                                : "what comes is no frame; check --baud, --model and the cable";
}

/* A line that stays silent is reported once, again when what comes tells more than nothing did, and then every hour. */
static void whisker_base_robot_log_silence(struct base_robot *robot, const struct base_unframed *came, int64_t now_ms)
{
    const bool tells_more = robot->reported_nothing && came->all > 0;
    if (robot->reported_ms == 0 || tells_more || now_ms - robot->reported_ms >= BASE_TELL_MS) {
        robot->reported_ms = now_ms;
        robot->reported_nothing = came->all == 0;
        base_log(&robot->log.silence, LOG_WARN,
                 "%s: no frame for %lld ms: %s; ordered to stop, but the wheels may turn; asked again every %d ms",
                 robot->options->port, (long long)(now_ms - robot->quiet_ms), whisker_base_robot_cause(came),
                 BASE_SILENCE_MS);
    }
}

/* Frames have stopped: stopped wheels are all that can be had without seeing. A base that left its mode by itself
 * before waits for the commander. */
static void whisker_base_robot_restart_stream(struct base_robot *robot, int64_t now_ms)
{
    robot->silences++;
    robot->unseen |= robot->frame_ms > 0;
    robot->silent = true;
    robot->phase_frames = 0;
    const struct base_unframed unframed = robot->unframed;
    robot->told_mm_s = robot->recalls == 0 ? robot->written.right_mm_s : robot->told_mm_s;
    robot->repeated = false;
    base_request(robot, now_ms);
    whisker_base_robot_log_silence(robot, &unframed, now_ms);
    robot->quiet_ms = now_ms;
}

/* How long a base may say nothing. */
static int64_t whisker_base_robot_patience_ms(const struct base_robot *robot)
{
    return !robot->silent && robot->answered && whisker_base_robot_astray(&robot->unframed) ? ASTRAY_MS
                                                                                            : BASE_SILENCE_MS;
}

static int64_t whisker_base_robot_least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* Keeps the base awake, or wakes it. */
static void whisker_base_robot_pulse(struct base_robot *robot, int64_t now_ms)
{
    const bool low = now_ms % BASE_PULSE_MS < BASE_LOW_MS;
    if (!robot->options->brc || robot->port < 0 || robot->low_brc == low) {
        return;
    }
    if (!create_port_wake(robot->port, low) && robot->low_brc < 0) {
        base_log(&robot->log.brc, LOG_WARN, "%s: --brc: this port has no line RTS; the base sleeps after 5 min of rest",
                 robot->options->port);
    }
    robot->low_brc = low;
}

int base_robot_watch(struct base_robot *robot, int64_t now_ms)
{
    base_orders_flush(robot, now_ms);
    whisker_base_robot_pulse(robot, now_ms);
    const int64_t request_ms = base_request_due(robot, now_ms, BASE_SILENCE_MS);
    if (robot->options->stream_clock || robot->port < 0) {
        return (int)base_orders_due_ms(robot, now_ms, BASE_REOPEN_MS);
    }
    if (whisker_base_robot_moving(robot) && now_ms - robot->drive_ms >= BASE_COMMANDER_MS) {
        whisker_base_robot_stop_commander(robot, now_ms);
    }
    if (now_ms - robot->quiet_ms >= whisker_base_robot_patience_ms(robot)) {
        whisker_base_robot_restart_stream(robot, now_ms);
    }
    if (robot->silent && !robot->recalled && now_ms - robot->opened_ms >= ANSWER_MS &&
        whisker_base_robot_astray(&robot->unframed)) {
        base_recall(robot, now_ms);
    }
    if (!robot->answered && !robot->repeated && robot->unframed.own > OWN_FRAMES) {
        base_repeat(robot, now_ms);
    }
    const int64_t passed_ms = now_ms - robot->quiet_ms;
    const bool strange = robot->unframed.all > 0 && passed_ms < ASTRAY_MS;
    const int64_t silence_ms = (strange ? ASTRAY_MS : BASE_SILENCE_MS) - passed_ms;
    const int64_t commander_ms =
        whisker_base_robot_moving(robot) ? robot->drive_ms + BASE_COMMANDER_MS - now_ms : silence_ms;
    return (int)base_orders_due_ms(
        robot, now_ms, whisker_base_robot_least(request_ms, whisker_base_robot_least(commander_ms, silence_ms)));
}

bool base_robot_end(struct base_robot *robot, int64_t now_ms)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    base_recall_end(robot);
    robot->may_turn = true;
    const bool stopped = base_robot_stop(robot, now_ms);
    if (stopped) {
        base_orders_write(robot, bytes, create_put_pause(bytes));
        base_orders_write(robot, bytes, create_put_opcode(bytes, CREATE_OI_OP_START));
    }
    return stopped;
}
