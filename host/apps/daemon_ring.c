#include "daemon_ring.h"

#include <signal.h>
#include <time.h>

#include "cli.h"
#include "daemon_stream.h"
#include "whisker/whisker.h"

/* A daemon that is to be replaced drains its bridge first. */
#define REPLACE_MS (DAEMON_DRAIN_MS + 5000)
#define REPLACE_LOOK_MS 20

/* Tells the writer of the ring to stop. The ring's lock says that it lives, so the number is its own. */
static bool stop_writer(const char *name)
{
    struct whisker_reader *reader;
    struct whisker_reader_info info;
    if (whisker_reader_attach(name, 0, &reader) != WHISKER_OK) {
        return false;
    }
    whisker_reader_info(reader, &info);
    whisker_reader_detach(reader);
    return info.writer_pid > 1 && kill((pid_t)info.writer_pid, SIGTERM) == 0;
}

int daemon_ring_make(const struct daemon_options *options, struct whisker_ring **ring)
{
    int error = whisker_ring_create(options->ring, options->frames, ring);
    const int64_t give_up_ms = cli_now_ms() + REPLACE_MS;
    if (error == WHISKER_ERROR_RING_BUSY && options->replace && stop_writer(options->ring)) {
        while (error == WHISKER_ERROR_RING_BUSY && cli_now_ms() < give_up_ms && !cli_stop_wanted()) {
            nanosleep(&(struct timespec){.tv_nsec = REPLACE_LOOK_MS * 1000000L}, NULL);
            error = whisker_ring_create(options->ring, options->frames, ring);
        }
    }
    return error;
}
