/*
 * The heartbeat of a supervisor: a pipe that it has left open for this process, with one byte every 100 ms. The end of
 * the pipe means that the supervisor has ended; HEARTBEAT_LOST_MS without a byte that it hangs. Without the variable in
 * the environment there is no supervisor, and nothing is watched.
 */
#ifndef WHISKER_HEARTBEAT_H
#define WHISKER_HEARTBEAT_H

#include <stdbool.h>
#include <stdint.h>

/* Names the descriptor of the pipe's read end. */
#define HEARTBEAT_VARIABLE "WHISKER_HEARTBEAT_FD"
#define HEARTBEAT_LOST_MS 300

struct heartbeat {
    int fd;           /* to wait on; -1: nothing is watched */
    int64_t heard_ms; /* when the newest byte was read, CLOCK_MONOTONIC */
};

/* Takes the descriptor over from the environment. False: the variable names no open descriptor. */
bool heartbeat_begin(struct heartbeat *heartbeat, int64_t now_ms);

/* Reads what has come, when poll() has found something. False: the supervisor has ended, and the pipe is closed. */
bool heartbeat_read(struct heartbeat *heartbeat, int64_t now_ms);

/* The time until which the heartbeat counts as alive; INT64_MAX: nothing is watched. */
int64_t heartbeat_until_ms(const struct heartbeat *heartbeat);

#endif
