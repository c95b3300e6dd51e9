/* What is known of the base, frame by frame: its mode, whether it heard its orders, its battery; and so whether its
 * wheels are kept stopped. Nothing is known of a base that is not heard. */
#include <string.h>

#include "create/port.h"
#include "daemon_log.h"
#include "whisker_base_orders.h"
#include "whisker_base_robot.h"

/* A base is in the mode it was asked for long before so many frames: before, it is asked for again every few. */
#define MODE_FRAMES 20
#define ASK_FRAMES 5
/* It does not enter its mode within 1 s, or says a higher one: a person is informed, and it begins anew. */
#define ENTER_FRAMES (1000 / CREATE_OI_PERIOD_MS)
/* An order shows in the frames after 60 ms at the latest: period, line, adapter, and the pace of a lock-step
 * simulation. Frames that say other speeds for longer: it was not heard, or not whole. */
#define UNHEARD_FRAMES 6
/* A battery of 12 cells: below a tenth of its charge, or 1.0 V a cell, the base will not drive for long. */
#define LOW_CHARGE 10
#define LOW_MV 12000

bool base_robot_heard(const struct base_robot *robot)
{
    return robot->port >= 0 && !robot->silent && robot->answered;
}

bool base_robot_kept(const struct base_robot *robot)
{
    return !base_robot_heard(robot) || robot->held != 0 || robot->phase != BASE_ENTERED ||
           robot->wanted == CREATE_OI_MODE_PASSIVE;
}

const char *base_robot_fate(const struct base_robot *robot)
{
    return base_orders_may_turn(robot) ? "no stop could be written: the wheels may turn"
           : !base_robot_heard(robot) || robot->unheard >= UNHEARD_FRAMES
               ? "ordered to stop, but not heard to: the wheels may turn"
               : "wheels stopped";
}

int32_t base_robot_mode_reported(const struct base_robot *robot)
{
    return robot->frame.value[CREATE_OI_MODE] - robot->mode_offset;
}

unsigned base_robot_bits(const struct base_robot *robot)
{
    const int32_t *value = robot->frame.value;
    const bool idle = base_robot_kept(robot);
    if (!base_robot_heard(robot)) {
        return BASE_IDLE;
    }
    return (unsigned)value[CREATE_OI_BUMPS_DROPS] | (value[CREATE_OI_CLIFF_LEFT] ? BASE_CLIFF_LEFT : 0u) |
           (value[CREATE_OI_CLIFF_FRONT_LEFT] ? BASE_CLIFF_FRONT_LEFT : 0u) |
           (value[CREATE_OI_CLIFF_FRONT_RIGHT] ? BASE_CLIFF_FRONT_RIGHT : 0u) |
           (value[CREATE_OI_CLIFF_RIGHT] ? BASE_CLIFF_RIGHT : 0u) | (idle ? BASE_IDLE : 0u);
}

static const char *whisker_base_state_mode_reason(const struct base_robot *robot)
{
    const unsigned bits = base_robot_bits(robot);
    return bits & (CREATE_OI_DROP_LEFT | CREATE_OI_DROP_RIGHT | CREATE_OI_DROP_CASTER) ? "a wheel dropped; set it down"
           : bits & (BASE_CLIFF_LEFT | BASE_CLIFF_FRONT_LEFT | BASE_CLIFF_FRONT_RIGHT | BASE_CLIFF_RIGHT)
               ? "a cliff; move it away"
           : robot->frame.value[CREATE_OI_CHARGING_SOURCES] ? "its charger; unplug it"
                                                            : "its own decision; look at its buttons and battery";
}

/* ------------------------------------------------------------------------------------------------------- the request
 */

/* Between two requests that clients cause: each is ten times an order to the wheels. */
#define REQUEST_PACE_MS 100
/* Zero bytes that end half an order to the wheels; with them a recall takes 367 ms at 300 baud, and the base waits for
 * CREATE_OI_BAUD_WAIT_MS before it goes by it. */
#define ORDER_LACKS 4
#define RECALL_MS 500
/* Of three recalls two are at the first speeds, which one bit makes of an order to the wheels: by the upper byte of
 * what it tells the right one. */
#define LIKELY 3
#define UPPER_BYTE 256
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
enum {
    ENCODERS = 2,     /* the last two: Create 2 only */
    ENCODER_BYTES = 3 /* of each in a frame */
};

static size_t whisker_base_state_packet_count(enum create_model model)
{
    return sizeof packets - (model == CREATE_2 ? 0 : ENCODERS);
}

/* The packets of this request, in its order. Returns how many. */
static size_t whisker_base_state_order_packets(const struct base_robot *robot, uint8_t ids[sizeof packets])
{
    const size_t count = whisker_base_state_packet_count(robot->options->odometry.model);
    for (size_t i = 0; i < count; i++) {
        ids[i] = packets[(i + robot->requests) % count];
    }
    return count;
}

/* The stream anew, its counts as they are. */
static void whisker_base_state_expect(struct base_robot *robot, const uint8_t *ids, size_t count)
{
    const struct create_stream_counts counts = robot->stream.counts;
    robot->before = robot->answered ? robot->stream : robot->before; /* the newest that was heard */
    create_stream_begin(&robot->stream, ids, count);
    robot->stream.counts = counts;
    robot->stream.skipped_before = counts.skipped;
    robot->unframed = (struct base_unframed){0};
    robot->answered = robot->request_due = false;
}

void base_recall(struct base_robot *robot, int64_t now_ms)
{
#define BAUD(code, baud) baud,
    static const uint32_t bauds[] = {CREATE_OI_BAUDS(BAUD)};
#undef BAUD
    uint8_t bytes[CREATE_COMMAND_BYTES];
    const uint32_t number = robot->recalls++, rest = number / LIKELY % (sizeof bauds / sizeof bauds[0]);
    const uint32_t first = robot->told_mm_s / UPPER_BYTE == 1, turn = number % LIKELY;
    const uint32_t baud = bauds[turn + 1 < LIKELY ? turn ^ first : rest];
    if (baud == robot->options->baud || !create_port_set_baud(robot->port, baud)) {
        return;
    }
    size_t count = ORDER_LACKS;
    memset(bytes, 0, count);
    count += create_put_drive_direct(bytes + count, 0, 0);
    count += create_put_baud(bytes + count, robot->options->baud);
    robot->cut_count = 0;
    base_orders_write(robot, bytes, count);
    robot->recalled = robot->port >= 0;
    robot->opened_ms = robot->quiet_ms = now_ms + RECALL_MS - BASE_SILENCE_MS;
}

void base_recall_end(struct base_robot *robot)
{
    robot->recalled = robot->recalled && !create_port_set_baud(robot->port, robot->options->baud);
}

void base_request(struct base_robot *robot, int64_t now_ms)
{
    uint8_t bytes[CREATE_COMMAND_BYTES], ids[sizeof packets];
    base_recall_end(robot);
    robot->requests++;
    robot->unheard_requests++;
    const size_t count = whisker_base_state_order_packets(robot, ids);
    whisker_base_state_expect(robot, ids, count);
    robot->opened_ms = now_ms;
    robot->phase = BASE_RESTING;
    robot->mode_offset = 0;
    robot->firm = robot->may_turn = true;
    base_orders_drop_opcode(robot);
    base_orders_wheels(robot, (struct create_speeds){0}, now_ms);
    base_orders_write(robot, bytes, create_put_opcode(bytes, CREATE_OI_OP_START));
    base_orders_write(robot, bytes, create_put_stream(bytes, ids, count));
}

void base_repeat(struct base_robot *robot, int64_t now_ms)
{
    base_orders_again(robot, now_ms);
    robot->repeated = true;
    robot->opened_ms = now_ms; /* the line is free before the next request */
    base_request_soon(robot, now_ms);
}

void base_request_soon(struct base_robot *robot, int64_t now_ms)
{
    robot->request_due = robot->port >= 0;
    base_request_due(robot, now_ms, 0);
}

int64_t base_request_due(struct base_robot *robot, int64_t now_ms, int64_t idle_ms)
{
    const int64_t due_ms = robot->opened_ms + (robot->recalled ? BASE_SILENCE_MS : REQUEST_PACE_MS) - now_ms;
    if (robot->request_due && (due_ms <= 0 || robot->options->stream_clock)) {
        base_request(robot, now_ms);
    }
    return robot->request_due && due_ms < idle_ms ? due_ms : idle_ms;
}

size_t base_request_other_bytes(const struct base_robot *robot)
{
    const size_t own = robot->stream.length - CREATE_OI_STREAM_OVERHEAD, more = (size_t)ENCODERS * ENCODER_BYTES;
    return robot->options->odometry.model == CREATE_2 ? own - more : own + more;
}

/* ---------------------------------------------------------------------------------------------------------- the mode
 */

static void whisker_base_state_begin_phase(struct base_robot *robot, enum base_phase phase, int64_t now_ms)
{
    robot->phase = phase;
    robot->phase_frames = 0;
    if (phase == BASE_RESTING) {
        base_request_soon(robot, now_ms);
    } else if (phase == BASE_ENTERING) {
        base_orders_opcode(robot, robot->wanted == CREATE_OI_MODE_FULL ? CREATE_OI_OP_FULL : CREATE_OI_OP_SAFE, now_ms);
    }
}

/* A mode that is in force, or on its way, is not begun anew: a commander may repeat itself faster than a base answers.
 */
void base_robot_ask_mode(struct base_robot *robot, enum create_oi_mode mode, int64_t now_ms)
{
    if (robot->wanted == mode && !robot->left) {
        return;
    }
    robot->wanted = mode;
    robot->left = false;
    whisker_base_state_begin_phase(robot, BASE_RESTING, now_ms);
}

/* Asks again every few frames. */
static void whisker_base_state_insist(struct base_robot *robot, int64_t now_ms)
{
    if (robot->phase_frames % ASK_FRAMES == 0) {
        const uint32_t frames = robot->phase_frames;
        whisker_base_state_begin_phase(robot, robot->phase, now_ms);
        robot->phase_frames = frames;
    }
}

static const char *whisker_base_state_mode_name(enum create_oi_mode mode)
{
    return mode == CREATE_OI_MODE_FULL ? "full" : mode == CREATE_OI_MODE_SAFE ? "safe" : "passive";
}

/* A base that was asked for passive again and again, and says one mode more: so it counts. */
static void whisker_base_state_rest(struct base_robot *robot, int64_t now_ms)
{
    const int32_t mode = robot->frame.value[CREATE_OI_MODE];
    const bool higher = mode == CREATE_OI_MODE_PASSIVE + 1;
    robot->phase_frames = higher ? robot->phase_frames : robot->phase_frames % ASK_FRAMES;
    if (mode != CREATE_OI_MODE_PASSIVE && !(higher && robot->phase_frames >= MODE_FRAMES)) {
        whisker_base_state_insist(robot, now_ms);
        return;
    }
    robot->mode_offset = higher;
    if (higher) {
        base_log(&robot->log.mode, LOG_NOTE, "%s: this firmware reports modes one higher than they are",
                 robot->options->port);
    }
    whisker_base_state_begin_phase(robot,
                                   robot->left                               ? BASE_LEFT
                                   : robot->wanted == CREATE_OI_MODE_PASSIVE ? BASE_ENTERED
                                                                             : BASE_ENTERING,
                                   now_ms);
}

static void whisker_base_state_enter(struct base_robot *robot, int64_t now_ms)
{
    if (base_robot_mode_reported(robot) > (int32_t)robot->wanted || robot->phase_frames >= ENTER_FRAMES) {
        base_log(&robot->log.mode, LOG_WARN, "%s: asked for %s mode, the base does not enter it: %s",
                 robot->options->port, whisker_base_state_mode_name(robot->wanted),
                 whisker_base_state_mode_reason(robot));
        whisker_base_state_begin_phase(robot, BASE_RESTING, now_ms);
    } else {
        whisker_base_state_insist(robot, now_ms);
    }
}

/* A base that leaves its mode has stopped its wheels, if that is what it meant; it goes back only when the commander
 * says so. */
static void whisker_base_state_leave(struct base_robot *robot, int64_t now_ms)
{
    robot->mode_losses++;
    robot->left = true;
    whisker_base_state_begin_phase(robot, BASE_LEFT, now_ms);
    base_orders_wheels(robot, (struct create_speeds){0}, now_ms);
    base_log(&robot->log.mode, LOG_WARN, "%s: the base has left its mode: %s, then send `mode %s`",
             robot->options->port, whisker_base_state_mode_reason(robot), whisker_base_state_mode_name(robot->wanted));
}

static void whisker_base_state_watch_mode(struct base_robot *robot, int64_t now_ms)
{
    const bool in_force = base_robot_mode_reported(robot) == (int32_t)robot->wanted;
    if (robot->request_due || !robot->answered) { /* what it says is of before */
        return;
    }
    robot->phase_frames++;
    if (robot->phase == BASE_RESTING) {
        whisker_base_state_rest(robot, now_ms);
    } else if (robot->phase == BASE_ENTERING && in_force) {
        whisker_base_state_begin_phase(robot, BASE_ENTERED, now_ms);
    } else if (robot->phase == BASE_ENTERING) {
        whisker_base_state_enter(robot, now_ms);
    } else if (robot->phase == BASE_ENTERED && base_robot_mode_reported(robot) > (int32_t)robot->wanted) {
        whisker_base_state_begin_phase(robot, BASE_RESTING, now_ms); /* of itself it goes to lower ones only: a lie */
    } else if (robot->phase == BASE_ENTERED && !in_force) {
        whisker_base_state_leave(robot, now_ms);
    }
}

/* Wheels that may turn are asked for what was ordered, or for one order after the other: a base that says the same all
 * the time has not heard them. */
static void whisker_base_state_watch_orders(struct base_robot *robot, int64_t now_ms)
{
    const int32_t left = robot->frame.value[CREATE_OI_REQUESTED_LEFT],
                  right = robot->frame.value[CREATE_OI_REQUESTED_RIGHT];
    const bool turns = base_robot_mode_reported(robot) >= CREATE_OI_MODE_SAFE;
    const bool same = left == robot->asked_left && right == robot->asked_right;
    robot->unheard = !turns || base_orders_heard(robot) ? 0 : same ? robot->unheard + 1 : 1;
    robot->asked_left = left;
    robot->asked_right = right;
    if (robot->unheard > 0 && robot->unheard % UNHEARD_FRAMES == 0) {
        base_log(
            &robot->log.orders, LOG_WARN,
            "%s: ordered %d and %d mm/s, the base says %d and %d: ordered again; the wheels may turn; check the wire "
            "to it",
            robot->options->port, robot->written.left_mm_s, robot->written.right_mm_s, left, right);
        base_orders_again(robot, now_ms);
    }
}

static void whisker_base_state_watch_battery(struct base_robot *robot)
{
    const int32_t *value = robot->frame.value;
    robot->low = value[CREATE_OI_VOLTAGE] < LOW_MV || value[CREATE_OI_CHARGE] * LOW_CHARGE < value[CREATE_OI_CAPACITY];
    if (robot->low && !robot->reported_low) {
        robot->reported_low = true;
        daemon_log(LOG_WARN, "%s: the battery is low: %d mV, %d of %d mAh; charge it", robot->options->port,
                   value[CREATE_OI_VOLTAGE], value[CREATE_OI_CHARGE], value[CREATE_OI_CAPACITY]);
    }
}

void base_robot_handle_frame(struct base_robot *robot, int64_t now_ms)
{
    whisker_base_state_watch_mode(robot, now_ms);
    whisker_base_state_watch_orders(robot, now_ms);
    whisker_base_state_watch_battery(robot);
}
