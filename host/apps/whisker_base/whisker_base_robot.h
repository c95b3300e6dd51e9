/*
 * The base as its driver sees it: port, stream, odometry, orders, and what makes wheels stop.
 *
 * Nothing here waits. Times are CLOCK_MONOTONIC in ms, given by the caller. After base_robot_begin() no memory is
 * allocated.
 */
#ifndef WHISKER_BASE_ROBOT_H
#define WHISKER_BASE_ROBOT_H

#include "base_record.h"

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

/* Orders the wheels; false: there is no line, or no room in it for a stop. Speeds really ordered: robot->speeds. */
bool base_robot_drive(struct base_robot *robot, double v_m_s, double omega_rad_s, int64_t now_ms);
bool base_robot_stop(struct base_robot *robot, int64_t now_ms);

/* "wheels stopped", or why they may turn all the same. */
const char *base_robot_fate(const struct base_robot *robot);

/* Stops the wheels and keeps them so for this reason, or takes the reason back. */
void base_robot_hold(struct base_robot *robot, enum base_hold reason, bool on, int64_t now_ms);

/* Whether a frame has come since the newest request, and the newest is not old. */
bool base_robot_heard(const struct base_robot *robot);

/* Whether the wheels are kept stopped, whatever is ordered: no port, a base that is not heard or not in its mode, or
 * held. */
bool base_robot_kept(const struct base_robot *robot);

/* Enters a mode, stopped; passive lets go. False: as of base_robot_stop(). */
bool base_robot_mode(struct base_robot *robot, enum create_oi_mode mode, int64_t now_ms);

/* The command was lost, or is taken by another: a mode that the commander before asked for is no longer wanted. One
 * that lets go stays until somebody takes the command. */
void base_robot_change_commander(struct base_robot *robot, bool taken, int64_t now_ms);

/* What time brings: writes what is due, stops wheels whose commander is silent, restarts a silent stream. Returns ms
 * until the next is due. */
int base_robot_watch(struct base_robot *robot, int64_t now_ms);

/* Stopped, stream paused, passive. False: no stop could be written yet. */
bool base_robot_end(struct base_robot *robot, int64_t now_ms);

/* One line of key=value, for people and programs. */
void base_robot_health(const struct base_robot *robot, char *text, size_t room);

/* Mode of the newest frame, as of enum create_oi_mode. */
int32_t base_robot_mode_reported(const struct base_robot *robot);

/* Asks the base to stand, to rest in passive mode and to send frames; soon: as soon as the line may have another
 * request. Until a frame comes the base counts as not heard.
 *
 * Every request orders the packets in another way. So a frame in that order was said by a base that has heard this
 * request, and of its mode nothing is believed that was said before. A frame in the order of the last request that was
 * heard on this connection is of a base that has not heard yet: it counts for what it says of motion and orders.
 */
void base_request(struct base_robot *robot, int64_t now_ms);
void base_request_soon(struct base_robot *robot, int64_t now_ms);

/* Orders the base to stand and to go at the port's speed again, at another speed, which is the port's until the
 * recall ends, at the next request at the latest; other orders wait for that. An order to the wheels that was altered
 * in one bit is one to the base's line: it goes at 300 or 600 baud then, and hears no stop. */
void base_recall(struct base_robot *robot, int64_t now_ms);
void base_recall_end(struct base_robot *robot);

/* Ends whatever a base that goes on as before takes for a command, and asks it again. */
void base_repeat(struct base_robot *robot, int64_t now_ms);

/* Requests what is due. Returns ms until it is; `idle_ms`: nothing is. */
int64_t base_request_due(struct base_robot *robot, int64_t now_ms, int64_t idle_ms);

/* Bytes of the packets in a frame as the other model would send it. */
size_t base_request_other_bytes(const struct base_robot *robot);

/* Begins to enter the wanted mode, from passive on. */
void base_robot_ask_mode(struct base_robot *robot, enum create_oi_mode mode, int64_t now_ms);

/* Takes note of mode, orders and battery in a new frame, asks for what is not in force, and says once what a person
 * should know. */
void base_robot_handle_frame(struct base_robot *robot, int64_t now_ms);

/* Bits of the newest frame; of a base that is not heard nothing but BASE_IDLE. */
unsigned base_robot_bits(const struct base_robot *robot);

#endif
