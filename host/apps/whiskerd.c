/* whiskerd: takes the frames of the bridge and publishes them in a ring, until it is told to stop. */
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "cli.h"
#include "whisker/whisker.h"

#define PROGRAM "whiskerd"
#define POLL_MS 100
/* After a stop the bridge sends its last frame within a tick; a simulated one takes as long as its machine needs. */
#define DRAIN_S 10

struct options {
    const char *ring;
    uint32_t frames;
    struct whisker_settings settings;
};

struct session {
    struct whisker_device *device;
    struct whisker_ring *ring;
    struct whisker_decoder decoder;
    bool last_seen;
    bool damage_told;
};

static void print_help(const struct whisker_settings *defaults)
{
    printf("Usage: whiskerd --ring NAME [OPTION...]\n"
           "Publishes the frames of the bridge in the shared-memory ring NAME, until SIGTERM or SIGINT.\n\n"
           "  --ring NAME         name of the ring; readers attach to it\n"
           "  --ring-frames N     its capacity, a power of two (%d)\n"
           "  --lane-mask M       bit n set: lane n is in use (0x%x)\n"
           "  --tick-period N     cycles of 60 MHz from tick to tick (%u)\n"
           "  --sck-divider N     cycles of 60 MHz of one SCK period (%u)\n"
           "  --word-gap N        cycles of 60 MHz between two 16-bit words (%u)\n"
           "  --sample-point N    cycles of 60 MHz from shifting to sampling (%u)\n"
           "  --help              this text\n\n"
           "Example: whiskerd --ring whisker --lane-mask 0x3f\n"
           "Exit code: 0 stopped as told, 1 failed, 2 wrong use.\n",
           WHISKER_RING_FRAMES, defaults->lane_mask, defaults->tick_period, defaults->sck_divider, defaults->word_gap,
           defaults->sample_point);
}

/* Sets one numeric option; false when its text is no number. Limits of the bridge are the library's to check. */
static bool set_number(struct options *options, const char *name, const char *text)
{
    struct whisker_settings *settings = &options->settings;
    const bool byte = !strcmp(name, "sck-divider") || !strcmp(name, "word-gap") || !strcmp(name, "sample-point");
    uint32_t value;
    if (!cli_number(PROGRAM, name, text, 0, byte ? UINT8_MAX : UINT32_MAX, &value)) {
        return false;
    }
    if (!strcmp(name, "ring-frames")) {
        options->frames = value;
    } else if (!strcmp(name, "lane-mask")) {
        settings->lane_mask = value;
    } else if (!strcmp(name, "tick-period")) {
        settings->tick_period = value;
    } else if (!strcmp(name, "sck-divider")) {
        settings->sck_divider = (uint8_t)value;
    } else if (!strcmp(name, "word-gap")) {
        settings->word_gap = (uint8_t)value;
    } else {
        settings->sample_point = (uint8_t)value;
    }
    return true;
}

/* Returns -1 to go on, or the exit code. */
static int parse(int argc, char **argv, struct options *options)
{
    static const struct option known[] = {
        {"ring", required_argument, NULL, 'r'},
        {"ring-frames", required_argument, NULL, 'n'},
        {"lane-mask", required_argument, NULL, 'n'},
        {"tick-period", required_argument, NULL, 'n'},
        {"sck-divider", required_argument, NULL, 'n'},
        {"word-gap", required_argument, NULL, 'n'},
        {"sample-point", required_argument, NULL, 'n'},
        {"help", no_argument, NULL, 'h'},
        {NULL, 0, NULL, 0},
    };
    int which = 0;
    for (int option; (option = getopt_long(argc, argv, "", known, &which)) != -1;) {
        if (option == 'h') {
            print_help(&options->settings);
            return CLI_OK;
        }
        if (option == '?' || (option == 'n' && !set_number(options, known[which].name, optarg))) {
            return CLI_USAGE;
        }
        options->ring = option == 'r' ? optarg : options->ring;
    }
    if (!options->ring || optind != argc) {
        fprintf(stderr, PROGRAM ": %s; see " PROGRAM " --help\n",
                options->ring ? "there is a word too many" : "--ring NAME is missing");
        return CLI_USAGE;
    }
    return -1;
}

static void on_bytes(void *context, const uint8_t *bytes, size_t count)
{
    struct session *session = context;
    const struct whisker_frame *frames;
    size_t made;
    if (whisker_ring_feed(session->ring, &session->decoder, bytes, count, &frames, &made) == 0 && made > 0) {
        session->last_seen |= (frames[made - 1].flags & WHISKER_FRAME_LAST) != 0;
    }
}

/* USB guards every packet by a CRC of its own, so a malformed frame is a fault of the bridge: said once, and again in
 * the exit code, while the other frames go on. */
static void tell_damage(struct session *session)
{
    const struct whisker_decoder *decoder = &session->decoder;
    if (decoder->first_error && !session->damage_told) {
        fprintf(stderr, PROGRAM ": bridge: after frame %llu: %s; %s\n", (unsigned long long)decoder->counts.frames,
                whisker_error_text(decoder->first_error), whisker_error_remedy(decoder->first_error));
        session->damage_told = true;
    }
}

static int open_bridge(struct session *session)
{
    struct whisker_identity identity;
    const int error = whisker_device_open(NULL, &session->device, &identity);
    if (error == WHISKER_ERROR_WIRE_VERSION) {
        fprintf(stderr, PROGRAM ": bridge: %s (bridge %u, host %d); %s\n", whisker_error_text(error),
                identity.wire_version, whisker_wire_version(), whisker_error_remedy(error));
        return CLI_FAILED;
    }
    return error ? cli_fail(PROGRAM, "bridge", error) : CLI_OK;
}

/* Seconds of a clock that nobody sets. */
static int64_t now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec;
}

/* Receives what the bridge still sends after a stop, up to its last frame. */
static int drain(struct session *session)
{
    const int64_t give_up = now_s() + DRAIN_S;
    int error = whisker_device_stop(session->device);
    while (!error && !session->last_seen && now_s() < give_up) {
        error = whisker_device_poll(session->device, POLL_MS);
    }
    whisker_device_flush(session->device);
    if (!error && !session->last_seen) {
        error = WHISKER_ERROR_DEVICE_DRAIN;
    }
    return error ? cli_fail(PROGRAM, "bridge", error) : CLI_OK;
}

static int stream(struct session *session, const struct whisker_settings *settings)
{
    int error = whisker_device_start(session->device, settings, on_bytes, session);
    while (!error && !cli_stop_wanted()) {
        error = whisker_device_poll(session->device, POLL_MS);
        tell_damage(session);
    }
    return error ? cli_fail(PROGRAM, "bridge", error) : drain(session);
}

static void report(struct session *session)
{
    whisker_decoder_end(&session->decoder);
    tell_damage(session);
    const struct whisker_decoder_counts *counts = &session->decoder.counts;
    fprintf(stderr, PROGRAM ": %llu frames published, %llu with damaged records, %llu bytes skipped\n",
            (unsigned long long)counts->frames, (unsigned long long)counts->frames_damaged,
            (unsigned long long)counts->bytes_skipped);
}

static int serve(const struct options *options)
{
    struct session session = {0};
    whisker_decoder_init(&session.decoder);
    int result = open_bridge(&session);
    if (result == CLI_OK) {
        const int error = whisker_ring_create(options->ring, options->frames, &session.ring);
        result = error ? cli_fail(PROGRAM, options->ring, error) : stream(&session, &options->settings);
    }
    if (session.ring) {
        report(&session);
    }
    whisker_device_close(session.device);
    whisker_ring_close(session.ring);
    return session.damage_told ? CLI_FAILED : result;
}

int main(int argc, char **argv)
{
    struct options options = {.frames = WHISKER_RING_FRAMES};
    whisker_settings_default(&options.settings);
    const int parsed = parse(argc, argv, &options);
    if (parsed >= 0) {
        return parsed;
    }
    char message[128];
    if (whisker_settings_check(&options.settings, message, sizeof message) != 0) {
        fprintf(stderr, PROGRAM ": %s\n", message);
        return CLI_USAGE;
    }
    cli_catch_signals();
    return serve(&options);
}
