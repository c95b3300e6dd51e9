/*
 * Orders on their way to the base: the newest and no other waits, at the pace of the line, and the line gets whole
 * ones. A stop waits for nothing but room, and is tried until it is written.
 */
#ifndef WHISKER_BASE_ORDERS_H
#define WHISKER_BASE_ORDERS_H

#include "base_record.h"

/* Writes an order, whole, or as much as there is room for and the rest later. False: there is no line, or no room. */
bool base_orders_write(struct base_robot *robot, const uint8_t *bytes, size_t count);

/* Closes a line that is gone. */
void base_orders_lose(struct base_robot *robot, const char *doing);

/* Orders speeds, or an opcode without arguments, as soon as it may be written. */
void base_orders_wheels(struct base_robot *robot, struct create_speeds speeds, int64_t now_ms);
void base_orders_opcode(struct base_robot *robot, enum create_oi_opcode opcode, int64_t now_ms);

/* Stops the wheels, at once and again behind enough zero bytes to end whatever the base takes for a command, and then
 * orders the speeds anew: an opcode that was altered may have it swallow what follows. */
void base_orders_again(struct base_robot *robot, int64_t now_ms);

/* An opcode that waits is no longer wanted. */
void base_orders_drop_opcode(struct base_robot *robot);

/* Whether the newest frame says that the base was asked for what was written last. */
bool base_orders_heard(const struct base_robot *robot);

/* What a base that hears at once has done since the last such call. */
struct create_ordered base_orders_take(struct base_robot *robot, int64_t now_ms);

/* Writes what is due. */
void base_orders_flush(struct base_robot *robot, int64_t now_ms);

/* For how many ms at most to sleep before the next order is due; `idle_ms`: there is none. */
int64_t base_orders_due_ms(const struct base_robot *robot, int64_t now_ms, int64_t idle_ms);

/* Whether the last stop is still to be written. */
bool base_orders_may_turn(const struct base_robot *robot);

#endif
