/* The daemon itself: bridge to ring, again and again, until it is asked to stop. */
#ifndef WHISKER_DAEMON_H
#define WHISKER_DAEMON_H

#include "daemon_options.h"

/* Runs to the end and returns the exit code; everything that goes wrong has been logged. */
int daemon_run(const struct daemon_options *options);

#endif
