/* The messages between the two processes of whisker-base, guard and driver. */
#ifndef BASE_LEASE_H
#define BASE_LEASE_H

#include <stdint.h>

#include "whisker_base_options.h"

/* What the driver reports to its guard, one per packet; PORT comes with the descriptor. */
enum base_report { BASE_PORT = 'P', BASE_NO_PORT = 'N', BASE_ALIVE = 'A' };

/*
 * What the guard sends to the driver again and again: until when, by CLOCK_MONOTONIC, the wheels may turn. It is never
 * further off than BASE_STUCK_MS, nor than the heartbeat of the supervisor allows: so a guard that hangs is noticed as
 * well as a supervisor that does. A message that was read late is seen by its time.
 */
struct base_lease {
    int64_t until_ms;
};

/* What the guard gives a driver. */
struct base_driver_start {
    const struct base_options *options;
    int guard;     /* socket to the guard; its end means that the guard is dead */
    int listening; /* socket of the clients */
    int port;      /* of the driver before; -1: none */
    uint64_t restarts;
    struct base_lease lease;
};

/* When guard or driver say nothing for so long, the other stops the wheels: before a watchdog of 0.3 s ends both. When
 * the driver says nothing for BASE_DEAD_MS it is ended and another started. */
#define BASE_STUCK_MS 200
#define BASE_DEAD_MS 2000

/* Exit code of a driver that could write no stop to a base that it had opened: the guard has to. */
#define BASE_TURNING 3

#endif
