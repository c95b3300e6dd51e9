#include "daemon_ring.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "cli.h"
#include "daemon_log.h"
#include "daemon_stream.h"
#include "whisker/whisker.h"

/* A daemon that is to be replaced drains its bridge first. */
#define REPLACE_MS (DAEMON_DRAIN_MS + 5000)
#define REPLACE_LOOK_MS 20

/* The service's directory where systemd has made it for this process; everybody else's directory otherwise. */
static const char *daemon_ring_directory(void)
{
    const char *given = getenv("RUNTIME_DIRECTORY");
    const bool is_service = given && strcmp(given, WHISKER_RING_SERVICE_DIRECTORY) == 0;
    return is_service ? WHISKER_RING_SERVICE_DIRECTORY : WHISKER_RING_DIRECTORY;
}

static int daemon_ring_create(const struct daemon_options *options, struct whisker_ring **ring)
{
    return whisker_ring_create_in(daemon_ring_directory(), options->ring, options->frames, ring);
}

static void daemon_ring_log(const char *name, const char *what, int error)
{
    char line[WHISKER_RING_LINE_BYTES];
    if (error == WHISKER_ERROR_SYSTEM) {
        daemon_log_error(LOG_ERROR, name, error);
    } else {
        whisker_ring_explain(name, error, line, sizeof line);
        daemon_log(LOG_ERROR, "%s: %s%s", name, what, line);
    }
}

/* Waits until the writer that was asked to stop has let the name go. */
static int daemon_ring_await(const struct daemon_options *options, struct whisker_ring **ring)
{
    const int64_t give_up_ms = cli_now_ms() + REPLACE_MS;
    int error = WHISKER_ERROR_RING_BUSY;
    while (error == WHISKER_ERROR_RING_BUSY && cli_now_ms() < give_up_ms && !cli_stop_wanted()) {
        nanosleep(&(struct timespec){.tv_nsec = REPLACE_LOOK_MS * 1000000L}, NULL);
        error = daemon_ring_create(options, ring);
    }
    return error;
}

int daemon_ring_make(const struct daemon_options *options, struct whisker_ring **ring)
{
    int error = daemon_ring_create(options, ring);
    const char *what = "";
    if (error == WHISKER_ERROR_RING_BUSY && options->replace) {
        const int refused = whisker_ring_signal_writer(options->ring, SIGTERM);
        what = refused ? "--replace: " : "";
        error = refused ? refused : daemon_ring_await(options, ring);
    }
    if (error) {
        daemon_ring_log(options->ring, what, error);
    }
    return error;
}
