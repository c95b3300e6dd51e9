#include "whisker_base_orders.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "create/port.h"

static bool orders_stand(const struct create_speeds *speeds)
{
    return speeds->left_mm_s == 0 && speeds->right_mm_s == 0;
}

bool base_orders_may_turn(const struct base_robot *robot)
{
    return robot->due && robot->may_turn && orders_stand(&robot->speeds);
}

void base_orders_drop_opcode(struct base_robot *robot)
{
    robot->opcode = (enum create_oi_opcode)0;
}

void base_orders_lose(struct base_robot *robot, const char *doing)
{
    base_log(&robot->log.line, LOG_WARN, "%s: %s: %s; the wheels may turn; plug it in again", robot->options->port,
             doing, strerror(errno));
    create_port_close(robot->port);
    robot->port = -1;
    robot->sent = 0;
    robot->cut_count = 0;
    robot->due = robot->request_due = false;
    base_orders_drop_opcode(robot);
    robot->speeds = (struct create_speeds){0};
}

/* Writes as much as there is room for: how much. */
static size_t orders_put(struct base_robot *robot, const uint8_t *bytes, size_t count)
{
    const int written = robot->port < 0 ? 0 : create_port_write(robot->port, bytes, count);
    if (written < 0) {
        base_orders_lose(robot, "cannot write");
        return 0;
    }
    robot->sent += (uint64_t)written;
    return (size_t)written;
}

/* Writes the rest of an order that was cut. False: there is still no room for it. */
static bool orders_complete(struct base_robot *robot)
{
    const size_t written = robot->cut_count > 0 ? orders_put(robot, robot->cut, robot->cut_count) : 0;
    robot->cut_count -= written < robot->cut_count ? written : robot->cut_count;
    memmove(robot->cut, robot->cut + written, robot->cut_count);
    return robot->cut_count == 0 && robot->port >= 0;
}

bool base_orders_write(struct base_robot *robot, const uint8_t *bytes, size_t count)
{
    const size_t written = orders_complete(robot) ? orders_put(robot, bytes, count) : 0;
    if (written > 0 && robot->port >= 0) {
        robot->cut_count = count - written;
        memcpy(robot->cut, bytes + written, robot->cut_count);
    }
    return written > 0;
}

static bool orders_write_speeds(struct base_robot *robot)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    const size_t count = create_put_drive_direct(bytes, robot->speeds.right_mm_s, robot->speeds.left_mm_s);
    return base_orders_write(robot, bytes, count);
}

/* A stop that ends whatever the base has half of, in place of what there was no room for. */
static bool orders_stop_firmly(struct base_robot *robot)
{
    uint8_t bytes[CREATE_COMMAND_BYTES];
    if (robot->port < 0 || !create_port_stop(robot->port)) {
        return false;
    }
    robot->sent += create_put_stop(bytes);
    robot->cut_count = 0;
    return true;
}

static bool orders_write_wheels(struct base_robot *robot)
{
    const bool stop = orders_stand(&robot->speeds);
    const bool plain = !robot->firm && robot->cut_count == 0;
    if (plain && orders_write_speeds(robot) && robot->cut_count == 0) {
        return true;
    }
    return (plain && !stop) ? robot->cut_count > 0 : orders_stop_firmly(robot) && (stop || orders_write_speeds(robot));
}

/* Whether an order has to wait for the line. In lock-step simulation nothing waits. */
static bool orders_wait(const struct base_robot *robot, int64_t before_ms, int64_t now_ms)
{
    return !robot->options->stream_clock &&
           (now_ms - before_ms < BASE_PACE_MS || robot->cut_count > 0 || create_port_waiting(robot->port) > 0);
}

/* Adds what the wheels do by the speeds written last, up to now. */
static void orders_account(struct base_robot *robot, int64_t now_ms)
{
    struct create_ordered *ordered = &robot->ordered;
    const double seconds = 1e-3 * (double)(now_ms > robot->ordered_ms ? now_ms - robot->ordered_ms : 0);
    const double distance = robot->written.v_m_s * seconds, angle = robot->written.omega_rad_s * seconds;
    ordered->distance += distance;
    ordered->angle += angle;
    ordered->way += fabs(distance);
    ordered->turn += fabs(angle);
    robot->ordered_ms = now_ms > robot->ordered_ms ? now_ms : robot->ordered_ms;
}

struct create_ordered base_orders_take(struct base_robot *robot, int64_t now_ms)
{
    const int64_t frames_ms = robot->ordered_ms + (int64_t)(robot->frame.missed + 1) * CREATE_OI_PERIOD_MS;
    orders_account(robot, robot->options->stream_clock ? frames_ms : now_ms);
    struct create_ordered ordered = robot->ordered;
    /* A plug that is loose cuts both wires: of several requests it was the last that was heard. */
    ordered.heard = base_orders_heard(robot) && robot->unheard_requests < 2;
    robot->unheard_requests = 0;
    robot->ordered = (struct create_ordered){0};
    return ordered;
}

bool base_orders_heard(const struct base_robot *robot)
{
    return robot->frame.value[CREATE_OI_REQUESTED_LEFT] == robot->written.left_mm_s &&
           robot->frame.value[CREATE_OI_REQUESTED_RIGHT] == robot->written.right_mm_s;
}

static void orders_flush_wheels(struct base_robot *robot, int64_t now_ms)
{
    const bool stop = orders_stand(&robot->speeds), urgent = stop && robot->may_turn;
    if (!robot->due || robot->recalled || (!urgent && orders_wait(robot, robot->written_ms, now_ms)) ||
        !orders_write_wheels(robot)) {
        return;
    }
    if (robot->speeds.left_mm_s != robot->written.left_mm_s || robot->speeds.right_mm_s != robot->written.right_mm_s) {
        /* In lock-step simulation time passes with frames alone. */
        orders_account(robot, robot->options->stream_clock ? robot->ordered_ms : now_ms);
        robot->ordered.changed = true;
    }
    robot->written = robot->speeds;
    robot->written_ms = now_ms;
    robot->may_turn = !stop;
    robot->due = robot->firm = false;
}

void base_orders_flush(struct base_robot *robot, int64_t now_ms)
{
    if (robot->port >= 0 && robot->cut_count > 0) {
        orders_complete(robot);
    }
    if (robot->port >= 0) {
        orders_flush_wheels(robot, now_ms);
    }
    uint8_t bytes[CREATE_COMMAND_BYTES];
    if (robot->port >= 0 && robot->opcode && !robot->recalled && !orders_wait(robot, robot->opcode_ms, now_ms) &&
        base_orders_write(robot, bytes, create_put_opcode(bytes, robot->opcode))) {
        robot->opcode_ms = now_ms;
        base_orders_drop_opcode(robot);
    }
}

void base_orders_wheels(struct base_robot *robot, struct create_speeds speeds, int64_t now_ms)
{
    /* One that is behind a pause does not complete what bytes that were lost have left half. */
    robot->firm |= !robot->options->stream_clock && now_ms - robot->written_ms >= BASE_SILENCE_MS;
    robot->due = robot->port >= 0;
    robot->speeds = robot->due ? speeds : (struct create_speeds){0};
    base_orders_flush(robot, now_ms);
}

void base_orders_again(struct base_robot *robot, int64_t now_ms)
{
    static const uint8_t zeros[CREATE_COMMAND_MOST];
    const struct create_speeds speeds = robot->speeds, stop = {0};
    robot->firm = robot->may_turn = true;
    base_orders_wheels(robot, stop, now_ms);
    if (robot->cut_count == 0) {
        orders_put(robot, zeros, sizeof zeros);
    }
    robot->may_turn = true;
    base_orders_wheels(robot, stop, now_ms);
    base_orders_wheels(robot, speeds, now_ms);
}

void base_orders_opcode(struct base_robot *robot, enum create_oi_opcode opcode, int64_t now_ms)
{
    robot->opcode = robot->port >= 0 ? opcode : (enum create_oi_opcode)0;
    base_orders_flush(robot, now_ms);
}

int64_t base_orders_due_ms(const struct base_robot *robot, int64_t now_ms, int64_t idle_ms)
{
    const int64_t wheels_ms = robot->written_ms + BASE_PACE_MS - now_ms,
                  opcode_ms = robot->opcode_ms + BASE_PACE_MS - now_ms;
    const int64_t due_ms = base_orders_may_turn(robot) || robot->cut_count > 0 ? 0
                           : robot->due                                        ? wheels_ms
                           : robot->opcode                                     ? opcode_ms
                                                                               : idle_ms;
    return due_ms < BASE_RETRY_MS && due_ms < idle_ms ? BASE_RETRY_MS : due_ms < idle_ms ? due_ms : idle_ms;
}
