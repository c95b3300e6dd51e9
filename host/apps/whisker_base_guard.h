/*
 * The two processes of whisker-base. The guard starts the driver and holds the same port. When the driver dies it stops
 * the wheels and starts another; when the guard dies the driver stops the wheels and ends.
 */
#ifndef WHISKER_BASE_GUARD_H
#define WHISKER_BASE_GUARD_H

#include <stdbool.h>
#include <stdint.h>

#include "whisker_base_options.h"

/* What the driver tells its guard, one per packet; PORT comes with the descriptor. */
enum base_tell { BASE_PORT = 'P', BASE_NO_PORT = 'N', BASE_ALIVE = 'A' };

/* What the guard gives a driver. */
struct base_driver_start {
    const struct base_options *options;
    int guard;     /* socket to the guard; its end means that the guard is dead */
    int listening; /* socket of the clients */
    int port;      /* of the driver before; -1: none */
    uint64_t restarts;
};

/* Without a word from the driver for so long the wheels are stopped; for so long it is ended and another started. */
#define BASE_STUCK_MS 300
#define BASE_DEAD_MS 2000

int base_guard_run(const struct base_options *options);

#endif
