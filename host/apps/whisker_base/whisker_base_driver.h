/* The driver process of whisker-base. */
#ifndef WHISKER_BASE_DRIVER_H
#define WHISKER_BASE_DRIVER_H

#include "base_lease.h"

/* Serves base and clients until SIGTERM, SIGINT or the guard's death. Returns the exit code. */
int base_driver_run(const struct base_driver_start *start);

#endif
