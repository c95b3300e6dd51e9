#include "daemon_options.h"

#include <stdio.h>
#include <string.h>

#include "cli.h"
#include "command_line.h"
#include "daemon_log.h"
#include "whisker/ring.h"

#define AT(field) offsetof(struct daemon_options, field)

static bool daemon_options_set_tick_in(void *options, const char *name, const char *edge)
{
    struct whisker_settings *settings = &((struct daemon_options *)options)->settings;
    const bool falling = !strcmp(edge, "falling");
    if (!falling && strcmp(edge, "rising") != 0) {
        return command_line_refuse(DAEMON_PROGRAM, name, edge, "give rising or falling");
    }
    settings->options |= WHISKER_OPTION_TICK_IN | (falling ? WHISKER_OPTION_FALLING : 0);
    return true;
}

static bool daemon_options_set_bridge(void *options, const char *name, const char *text)
{
    (void)text;
    ((struct daemon_options *)options)->settings.options |=
        !strcmp(name, "pattern") ? WHISKER_OPTION_PATTERN : WHISKER_OPTION_EVERY_FRAME;
    return true;
}

/* Limits of the bridge's settings are the library's to check. */
static const struct command_option OPTIONS[] = {
    {"ring", "NAME", "name of the ring; readers attach to it", COMMAND_TEXT, AT(ring), 0, 0, NULL},
    {"ring-frames", "N", "its capacity, a power of two", COMMAND_NUMBER, AT(frames), 0, UINT32_MAX, NULL},
    {"serial", "TEXT", "the bridge with this serial number (the first that can be opened)", COMMAND_TEXT, AT(serial), 0,
     0, NULL},
    {"wait", NULL, "wait for a bridge instead of failing when there is none", COMMAND_FLAG, AT(wait), 0, 0, NULL},
    {"once", NULL, "end when the bridge goes, instead of waiting for it", COMMAND_FLAG, AT(once), 0, 0, NULL},
    {"replace", NULL, "stop the whiskerd that has this ring, if it is yours, root's or the service's, and\ntake over",
     COMMAND_FLAG, AT(replace), 0, 0, NULL},
    {"list", NULL, "print serial number, place and state of each bridge", COMMAND_FLAG, AT(list), 0, 0, NULL},
    {"batch", "N", "frames of one USB transfer, even, 2 to 64: latency against work", COMMAND_BYTE, AT(settings.batch),
     0, UINT8_MAX, NULL},
    {"lane-mask", "M", "bit n set: lane n is in use", COMMAND_MASK, AT(settings.lane_mask), 0, UINT32_MAX, NULL},
    {"tick-period", "N", "cycles of 60 MHz from tick to tick", COMMAND_NUMBER, AT(settings.tick_period), 0, UINT32_MAX,
     NULL},
    {"sck-divider", "N", "cycles of 60 MHz of one SCK period", COMMAND_BYTE, AT(settings.sck_divider), 0, UINT8_MAX,
     NULL},
    {"word-gap", "N", "cycles of 60 MHz between two 16-bit words", COMMAND_BYTE, AT(settings.word_gap), 0, UINT8_MAX,
     NULL},
    {"sample-point", "N", "cycles of 60 MHz from shifting to sampling", COMMAND_BYTE, AT(settings.sample_point), 0,
     UINT8_MAX, NULL},
    {"tick-in", "EDGE",
     "ticks begin with the rising or the falling edges of the bridge's pin tick_in, a\n"
     "tick period apart: another bridge's tick_out, a camera, a PPS",
     COMMAND_OWN, 0, 0, 0, daemon_options_set_tick_in},
    {"every-frame", NULL, "the bridge sends each frame at once instead of two in a packet", COMMAND_OWN, 0, 0, 0,
     daemon_options_set_bridge},
    {"pattern", NULL, "records of the bridge's own in place of the nodes': proves FPGA, FIFO and USB", COMMAND_OWN, 0,
     0, 0, daemon_options_set_bridge},
    {"verbose", NULL, "log successful steps, too", COMMAND_FLAG, AT(verbose), 0, 0, NULL},
};

static const struct command_line LINE = {
    .program = DAEMON_PROGRAM,
    .usage =
        "Usage: whiskerd --ring NAME [OPTION...]\n"
        "       whiskerd --list\n"
        "Publishes the frames of the bridge in the shared-memory ring NAME, until SIGTERM or SIGINT. When the bridge\n"
        "is unplugged the ring stays open and the next bridge goes on in it.\n",
    .notes =
        "SIGUSR1: statistics to the log, as at the end. SIGUSR2: who the nodes are and what they counted, likewise.\n"
        "Under systemd: notifies readiness, feeds the watchdog; with RUNTIME_DIRECTORY=" WHISKER_RING_SERVICE_DIRECTORY
        " the ring lies\nthere, else in " WHISKER_RING_DIRECTORY ". Readers look in both, in this order.\n\n"
        "Example: whiskerd --ring whisker --lane-mask 0x3f\n"
        "Example: whiskerd --ring whisker --wait --serial 0001\n"
        "Exit code: 0 stopped on request, 1 failed, 2 wrong use.\n",
    .option = OPTIONS,
    .count = sizeof OPTIONS / sizeof *OPTIONS,
};

static int daemon_options_check(const struct daemon_options *options, bool word_too_many)
{
    char message[128];
    if (word_too_many || (!options->ring && !options->list)) {
        return command_line_wrong(DAEMON_PROGRAM,
                                  word_too_many ? "there is a word too many" : "--ring NAME is missing");
    }
    if (whisker_settings_check(&options->settings, message, sizeof message) != 0) {
        fprintf(stderr, DAEMON_PROGRAM ": %s\n", message);
        return CLI_USAGE;
    }
    return COMMAND_LINE_READ;
}

int daemon_options_parse(int argc, char **argv, struct daemon_options *options)
{
    *options = (struct daemon_options){.frames = WHISKER_RING_FRAMES};
    whisker_settings_default(&options->settings);
    int rest;
    const int result = command_line_read(&LINE, argc, argv, options, &rest);
    return result == COMMAND_LINE_READ ? daemon_options_check(options, rest != argc) : result;
}
