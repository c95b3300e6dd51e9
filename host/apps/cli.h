/* What the programs share: users from the command line, signals, and errors as one line. */
#ifndef WHISKER_CLI_H
#define WHISKER_CLI_H

#include <stdbool.h>
#include <stdint.h>

enum { CLI_OK = 0, CLI_FAILED = 1, CLI_USAGE = 2 };

/* Prints "program: subject: text; remedy" for a code of the library and returns CLI_FAILED. */
int cli_fail(const char *program, const char *subject, int error);

/* The exit code of a program that ends with `code`, once all that it has printed is written: CLI_FAILED, with one line
 * printed, if that could not be. */
int cli_end(const char *program, int code);

/* Does the same for the ring `name`; the line also says which file is meant and whose it is. */
int cli_fail_ring(const char *program, const char *name, int error);

/* Reads an option's user, by name or number; false, with one line printed, if there is none. */
bool cli_user(const char *program, const char *option, const char *text, uint32_t *id);

/* CLOCK_MONOTONIC in ms. */
int64_t cli_now_ms(void);

/* Turns SIGINT, SIGTERM and SIGHUP into a wish to end. Blocking calls are interrupted. */
void cli_catch_signals(void);

/* Whether one of them has come. */
bool cli_stop_wanted(void);

#endif
