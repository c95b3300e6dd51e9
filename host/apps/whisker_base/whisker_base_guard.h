/*
 * The two processes of whisker-base. The guard starts the driver and holds the same port. When the driver dies it stops
 * the wheels and starts another; when the guard dies the driver stops the wheels and ends. When guard or supervisor
 * hang the driver stops the wheels until they are back; when the supervisor ends so does whisker-base.
 */
#ifndef WHISKER_BASE_GUARD_H
#define WHISKER_BASE_GUARD_H

#include "whisker_base_options.h"

int base_guard_run(const struct base_options *options);

#endif
