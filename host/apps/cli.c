#include "cli.h"

#include <errno.h>
#include <pwd.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "whisker/errors.h"
#include "whisker/ring.h"

static volatile sig_atomic_t stop_wanted;

int64_t cli_now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static void cli_on_signal(int number)
{
    (void)number;
    stop_wanted = 1;
}

void cli_catch_signals(void)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = cli_on_signal;
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
}

bool cli_stop_wanted(void)
{
    return stop_wanted != 0;
}

int cli_fail(const char *program, const char *subject, int error)
{
    const char *detail = error == WHISKER_ERROR_SYSTEM ? strerror(errno) : whisker_error_remedy(error);
    fprintf(stderr, "%s: %s: %s; %s\n", program, subject, whisker_error_text(error), detail);
    return CLI_FAILED;
}

int cli_end(const char *program, int code)
{
    const bool lost = ferror(stdout) != 0; /* the error of an earlier write is not known any more */
    if (fflush(stdout) == 0 && !lost) {
        return code;
    }
    fprintf(stderr, "%s: standard output: %s; make room there, or send it to another place\n", program,
            lost ? "cannot be written" : strerror(errno));
    return code == CLI_OK ? CLI_FAILED : code;
}

int cli_fail_ring(const char *program, const char *name, int error)
{
    char line[WHISKER_RING_LINE_BYTES];
    if (error == WHISKER_ERROR_SYSTEM) {
        return cli_fail(program, name, error);
    }
    whisker_ring_explain(name, error, line, sizeof line);
    fprintf(stderr, "%s: %s: %s\n", program, name, line);
    return CLI_FAILED;
}

bool cli_user(const char *program, const char *option, const char *text, uint32_t *id)
{
    const struct passwd *entry = getpwnam(text);
    char *end;
    const unsigned long number = strtoul(text, &end, 10);
    const bool is_number = text[0] >= '0' && text[0] <= '9' && *end == '\0' && number < UINT32_MAX;
    if (!entry && !is_number) {
        fprintf(stderr, "%s: --%s %s: there is no such user; give a user's name or number\n", program, option, text);
        return false;
    }
    *id = entry ? entry->pw_uid : (uint32_t)number;
    return true;
}
