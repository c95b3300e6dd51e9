/* whisker-log: a reader of its own that counts what arrived and writes down what was flagged bad. */
#include <errno.h>
#include <inttypes.h>
#include <pwd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "command_line.h"
#include "follower.h"
#include "output_file.h"
#include "whisker/whisker.h"

#define PROGRAM "whisker-log"
#define WAIT_MS 500
#define BATCH 256
/* A simulation runs up to 4096 ticks ahead; saying how far we are this often keeps it going. */
#define TAKEN_TICKS 512

struct options {
    const char *ring, *bad, *summary, *socket;
    uint32_t lanes, wait_s, owner;
    bool overwrite;
};

struct tally {
    uint64_t received, gaps, repeated, first_tick, last_tick, records_bad, overruns;
    uint32_t sequence;
};

struct session {
    const struct options *options;
    struct whisker_reader *reader;
    struct follower follower;
    struct output_file bad, summary;
    struct tally tally;
    uint64_t taken; /* ticks reported to the simulation */
};

static bool whisker_log_set_owner(void *options, const char *name, const char *text)
{
    return cli_user(PROGRAM, name, text, &((struct options *)options)->owner);
}

#define AT(field) offsetof(struct options, field)

static const struct command_option OPTIONS[] = {
    {"ring", "NAME", "the ring to read", COMMAND_TEXT, AT(ring), 0, 0, NULL},
    {"ring-owner", "U", "accept a ring of this user, too, not only root's, your own and the service's", COMMAND_OWN, 0,
     0, 0, whisker_log_set_owner},
    {"lanes", "N", "lanes 0 to N-1 are populated; others are not judged", COMMAND_NUMBER, AT(lanes), 1,
     WHISKER_FRAME_LANES, NULL},
    {"bad", "FILE", "CSV: lane, tick, code, errors of each bad record", COMMAND_TEXT, AT(bad), 0, 0, NULL},
    {"summary", "FILE", "JSON: what was counted", COMMAND_TEXT, AT(summary), 0, 0, NULL},
    {"overwrite", NULL, "replace these files where they are there already", COMMAND_FLAG, AT(overwrite), 0, 0, NULL},
    {"wait", "S", "wait so many seconds for the ring to come up", COMMAND_NUMBER, AT(wait_s), 0, 3600, NULL},
    {"socket", "PATH", "follow the simulation at this socket: it never runs too far ahead", COMMAND_TEXT, AT(socket), 0,
     0, NULL},
};

static const struct command_line LINE = {
    .program = PROGRAM,
    .usage = "Usage: whisker-log --ring NAME [OPTION...]\n"
             "Reads a ring until its writer closes it; counts frames and logs the records flagged bad.\n",
    .notes = "Example: whisker-log --ring whisker --lanes 6 --bad bad.csv --summary log.json\n"
             "Exit code: 0 the ring was closed or a signal came, 1 failed, 2 wrong use.\n",
    .option = OPTIONS,
    .count = sizeof OPTIONS / sizeof *OPTIONS,
};

/* Returns -1 to go on, or the exit code. */
static int whisker_log_parse(int argc, char **argv, struct options *options)
{
    int rest;
    const int result = command_line_read(&LINE, argc, argv, options, &rest);
    if (result == COMMAND_LINE_READ && (!options->ring || rest != argc)) {
        return command_line_wrong(PROGRAM, options->ring ? "there is a word too many" : "--ring NAME is missing");
    }
    return result;
}

static void log_bad_records(struct session *session, const struct whisker_frame *frame)
{
    for (uint32_t lane = 0; lane < session->options->lanes; lane++) {
        const unsigned status = frame->lane[lane].status;
        if (status == 0) {
            continue;
        }
        session->tally.records_bad++;
        if (session->bad.file) {
            const unsigned errors = status & ((1u << WHISKER_STATUS_ERROR_BITS) - 1);
            fprintf(session->bad.file, "%u,%" PRIu64 ",%u,%u\n", lane, frame->tick, status >> WHISKER_STATUS_ERROR_BITS,
                    errors);
        }
    }
}

static void whisker_log_count_frame(struct session *session, const struct whisker_frame *frame)
{
    struct tally *tally = &session->tally;
    const bool begins = tally->received == 0 || (frame->flags & WHISKER_FRAME_GAP) != 0;
    const uint32_t step = begins ? 1 : frame->sequence - tally->sequence; /* modulo 2^32: it wraps */
    if (step == 0 || step > UINT32_MAX / 2) {
        tally->repeated++;
        return;
    }
    if (tally->received == 0) {
        tally->first_tick = frame->tick;
    }
    tally->received++;
    tally->gaps += step - 1;
    tally->sequence = frame->sequence;
    tally->last_tick = frame->tick;
    log_bad_records(session, frame);
}

static void whisker_log_report_simulation(struct session *session)
{
    const struct tally *tally = &session->tally;
    if (tally->received > 0 && tally->last_tick + 1 - session->taken >= TAKEN_TICKS) {
        follower_taken(&session->follower, tally->last_tick);
        session->taken = tally->last_tick + 1;
    }
}

/* Takes a batch out of the ring. It is copied, so that only frames known to be whole are counted. Returns 0, or why the
 * ring gives nothing more. */
static int whisker_log_read_batch(struct session *session)
{
    static struct whisker_frame batch[BATCH];
    const struct whisker_frame *frames;
    size_t count;
    int error = whisker_reader_peek(session->reader, &frames, &count);
    if (!error) {
        count = count < BATCH ? count : BATCH;
        memcpy(batch, frames, count * sizeof *frames);
        error = whisker_reader_advance(session->reader, count);
    }
    if (error) {
        session->tally.overruns += error == WHISKER_ERROR_OVERRUN;
        return error == WHISKER_ERROR_OVERRUN ? WHISKER_OK : error;
    }
    for (size_t i = 0; i < count; i++) {
        whisker_log_count_frame(session, &batch[i]);
    }
    whisker_log_report_simulation(session);
    return WHISKER_OK;
}

/* Reads to the end of the stream and returns how it ended. */
static int whisker_log_read_stream(struct session *session)
{
    while (!cli_stop_wanted()) {
        int error = whisker_reader_wait(session->reader, WAIT_MS);
        error = error ? error : whisker_log_read_batch(session);
        if (error && error != WHISKER_ERROR_TIMEOUT) {
            return error;
        }
    }
    return WHISKER_OK;
}

static void whisker_log_write_summary(FILE *file, const struct tally *tally)
{
    fprintf(file,
            "{\"frames_received\": %" PRIu64 ", \"gaps\": %" PRIu64 ", \"repeated\": %" PRIu64
            ", \"first_tick\": %" PRIu64 ", \"last_tick\": %" PRIu64 ", \"records_bad\": %" PRIu64
            ", \"overruns\": %" PRIu64 "}\n",
            tally->received, tally->gaps, tally->repeated, tally->first_tick, tally->last_tick, tally->records_bad,
            tally->overruns);
}

static int whisker_log_fail_file(const char *path)
{
    const char *remedy = errno == EEXIST ? "give --overwrite, or another name" : "choose a path that can be written";
    fprintf(stderr, PROGRAM ": %s: %s; %s\n", path, strerror(errno), remedy);
    return CLI_FAILED;
}

static int whisker_log_open_file(struct output_file *out, const char *path, bool overwrite)
{
    return path && output_file_open(out, path, overwrite) != 0 ? whisker_log_fail_file(path) : CLI_OK;
}

static int whisker_log_close_file(struct output_file *out, const char *path)
{
    return out->file && output_file_close(out) != 0 ? whisker_log_fail_file(path) : CLI_OK;
}

static void whisker_log_print_ring(const struct whisker_reader *reader, const char *name)
{
    struct whisker_reader_info info;
    whisker_reader_info(reader, &info);
    const struct passwd *owner = getpwuid(info.owner);
    if (owner) {
        printf(PROGRAM ": reading ring %s of user %s\n", name, owner->pw_name);
    } else {
        printf(PROGRAM ": reading ring %s of user %u\n", name, info.owner);
    }
    fflush(stdout);
}

static int whisker_log_follow(struct session *session)
{
    const struct options *options = session->options;
    whisker_log_print_ring(session->reader, options->ring);
    if (follower_open(&session->follower, options->socket, "log") != 0) {
        fprintf(stderr, PROGRAM ": %s: %s; start the simulation with this --socket\n", options->socket,
                strerror(errno));
        return CLI_FAILED;
    }
    const int end = whisker_log_read_stream(session);
    if (session->tally.received > 0) {
        follower_taken(&session->follower, session->tally.last_tick);
    }
    const bool ended_well = end == WHISKER_OK || end == WHISKER_ERROR_CLOSED || end == WHISKER_ERROR_RESTARTED;
    return ended_well ? CLI_OK : cli_fail_ring(PROGRAM, options->ring, end);
}

static int log_ring(struct session *session)
{
    const struct options *options = session->options;
    const int error =
        whisker_reader_attach_owned(options->ring, options->owner, (int)options->wait_s * 1000, &session->reader);
    if (error) {
        return cli_fail_ring(PROGRAM, options->ring, error);
    }
    int result = whisker_log_open_file(&session->bad, options->bad, options->overwrite);
    result = result ? result : whisker_log_open_file(&session->summary, options->summary, options->overwrite);
    if (session->bad.file) {
        fputs("lane,tick,code,errors\n", session->bad.file);
    }
    result = result ? result : whisker_log_follow(session);
    if (session->summary.file) {
        whisker_log_write_summary(session->summary.file, &session->tally);
    }
    const int bad = whisker_log_close_file(&session->bad, options->bad);
    const int summary = whisker_log_close_file(&session->summary, options->summary);
    return bad ? bad : summary ? summary : result;
}

int main(int argc, char **argv)
{
    struct options options = {.lanes = WHISKER_FRAME_LANES, .wait_s = 10, .owner = WHISKER_RING_NO_OWNER};
    const int parsed = whisker_log_parse(argc, argv, &options);
    if (parsed >= 0) {
        return cli_end(PROGRAM, parsed);
    }
    cli_catch_signals();
    struct session session = {.options = &options, .follower = {.fd = -1}};
    const int result = log_ring(&session);
    follower_close(&session.follower);
    whisker_reader_detach(session.reader);
    return cli_end(PROGRAM, result);
}
