/* The command line of whisker-base. */
#ifndef WHISKER_BASE_OPTIONS_H
#define WHISKER_BASE_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "create/odometry.h"
#include "create_oi.h"

struct base_options {
    const char *port, *socket; /* paths */
    uint32_t baud;
    bool full;         /* full mode instead of safe */
    bool stream_clock; /* time is counted in frames of the stream */
    bool wait, verbose;
    bool brc; /* the cable has a wire to the base's BRC pin */
    struct create_odometry_settings odometry;
};

/* Reads the command line. Returns -1 to go on, or the exit code: help was printed, or one line that says what is wrong.
 */
int base_options_parse(int argc, char **argv, struct base_options *options);

#endif
