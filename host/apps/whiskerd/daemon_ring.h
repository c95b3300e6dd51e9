/* The daemon's ring: a new one, or the name of a daemon that is to be replaced. */
#ifndef WHISKER_DAEMON_RING_H
#define WHISKER_DAEMON_RING_H

#include "daemon_options.h"

struct whisker_ring;

/* Makes the ring that the options name: in the service's directory if RUNTIME_DIRECTORY names it. With `replace` a
 * daemon that has the name is asked to stop, and waited for. Returns 0, or why there is none, which has been logged. */
int daemon_ring_make(const struct daemon_options *options, struct whisker_ring **ring);

#endif
