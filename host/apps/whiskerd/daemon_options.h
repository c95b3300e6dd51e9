/* The command line of whiskerd. */
#ifndef WHISKER_DAEMON_OPTIONS_H
#define WHISKER_DAEMON_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "whisker/device.h"

struct daemon_options {
    const char *ring;
    const char *serial; /* NULL: any bridge */
    uint32_t frames;
    bool list, wait, once, replace, verbose;
    struct whisker_settings settings;
};

/* Reads the command line. Returns -1 to go on, or the exit code: help was printed, or one line that says what is wrong.
 */
int daemon_options_parse(int argc, char **argv, struct daemon_options *options);

#endif
