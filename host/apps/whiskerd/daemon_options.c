#include "daemon_options.h"

#include <getopt.h>
#include <stdio.h>
#include <string.h>

#include "cli.h"
#include "daemon_log.h"
#include "whisker/pair.h"
#include "whisker/ring.h"

enum { NUMBER = 'n' };

static void daemon_options_print_help(const struct whisker_settings *defaults)
{
    printf(
        "Usage: whiskerd --ring NAME [OPTION...]\n"
        "       whiskerd --list\n"
        "Publishes the frames of the bridge in the shared-memory ring NAME, until SIGTERM or SIGINT. When the bridge\n"
        "is unplugged the ring stays open and the next bridge goes on in it.\n\n"
        "  --ring NAME         name of the ring; readers attach to it\n"
        "  --ring-frames N     its capacity, a power of two (%d)\n"
        "  --serial TEXT       the bridge with this serial number (the first that can be opened)\n"
        "  --second TEXT       a second bridge, of this serial number (with --serial): its ticks begin with the first\n"
        "                      one's tick_out, or with --tick-in both take the same source; its lanes are 28 to 55\n"
        "  --second-lane-mask M  bit n set: lane n of the second bridge is in use (0x%x)\n"
        "  --wait              wait for a bridge instead of failing when there is none\n"
        "  --once              end when the bridge goes, instead of waiting for it\n"
        "  --replace           stop the whiskerd that has this ring, if it is yours, root's or the service's, and take "
        "over\n"
        "  --list              print serial number, place and state of each bridge\n"
        "  --batch N           frames of one USB transfer, even, 2 to 16: latency against work (%u)\n"
        "  --lane-mask M       bit n set: lane n is in use (0x%x)\n"
        "  --tick-period N     cycles of 60 MHz from tick to tick (%u)\n"
        "  --sck-divider N     cycles of 60 MHz of one SCK period (%u)\n"
        "  --word-gap N        cycles of 60 MHz between two 16-bit words (%u)\n"
        "  --sample-point N    cycles of 60 MHz from shifting to sampling (%u)\n"
        "  --tick-in EDGE      ticks begin with the rising or the falling edges of the bridge's pin tick_in, a\n"
        "                      tick period apart: another bridge's tick_out, a camera, a PPS\n"
        "  --every-frame       the bridge sends each frame at once instead of two in a packet\n"
        "  --pattern           records of the bridge's own in place of the nodes': proves FPGA, FIFO and USB\n"
        "  --verbose           tell also what goes well\n"
        "  --help              this text\n\n"
        "SIGUSR1: statistics to the log, as at the end. SIGUSR2: who the nodes are and what they counted, likewise.\n"
        "Under systemd: notifies readiness, feeds the watchdog; with RUNTIME_DIRECTORY=" WHISKER_RING_SERVICE_DIRECTORY
        " the ring lies\nthere, else in " WHISKER_RING_DIRECTORY ". Readers look in both, in this order.\n\n"
        "Example: whiskerd --ring whisker --lane-mask 0x3f\n"
        "Example: whiskerd --ring whisker --wait --serial 0001\n"
        "Exit code: 0 stopped on request, 1 failed, 2 wrong use.\n",
        WHISKER_RING_FRAMES, defaults->lane_mask, defaults->batch, defaults->lane_mask, defaults->tick_period,
        defaults->sck_divider, defaults->word_gap, defaults->sample_point);
}

/* Sets one numeric option; false when its text is no number. Limits of the bridge are the library's to check. */
static bool daemon_options_set_number(struct daemon_options *options, const char *name, const char *text)
{
    struct whisker_settings *settings = &options->settings;
    uint8_t *byte = cli_byte_setting(settings, name);
    uint32_t value;
    if (!cli_number(DAEMON_PROGRAM, name, text, 0, byte ? UINT8_MAX : UINT32_MAX, &value)) {
        return false;
    }
    if (byte) {
        *byte = (uint8_t)value;
    } else if (!strcmp(name, "ring-frames")) {
        options->frames = value;
    } else if (!strcmp(name, "lane-mask")) {
        settings->lane_mask = value;
    } else if (!strcmp(name, "second-lane-mask")) {
        options->second_lane_mask = value;
    } else {
        settings->tick_period = value;
    }
    return true;
}

static bool daemon_options_set_tick_in(struct whisker_settings *settings, const char *edge)
{
    const bool falling = !strcmp(edge, "falling");
    if (!falling && strcmp(edge, "rising") != 0) {
        fprintf(stderr, DAEMON_PROGRAM ": --tick-in %s: give rising or falling\n", edge);
        return false;
    }
    settings->options |= WHISKER_OPTION_TICK_IN | (falling ? WHISKER_OPTION_FALLING : 0);
    return true;
}

static bool daemon_options_set_word(struct daemon_options *options, int option, const char *text)
{
    switch (option) {
    case 'r':
        options->ring = text;
        return true;
    case 's':
        options->serial = text;
        return true;
    case '2':
        options->second = text;
        return true;
    case 'l':
        return options->list = true;
    case 'w':
        return options->wait = true;
    case 'o':
        return options->once = true;
    case 'x':
        return options->replace = true;
    case 'v':
        return options->verbose = true;
    case 'e':
        options->settings.options |= WHISKER_OPTION_EVERY_FRAME;
        return true;
    case 'p':
        options->settings.options |= WHISKER_OPTION_PATTERN;
        return true;
    case 't':
        return daemon_options_set_tick_in(&options->settings, text);
    default:
        return false;
    }
}

/* NULL, or what is wrong with the options of two bridges. */
static const char *daemon_options_check_second(const struct daemon_options *options)
{
    struct whisker_settings second = options->settings;
    second.lane_mask = options->second_lane_mask;
    if (!options->second) {
        return NULL;
    }
    return !options->serial                            ? "--second: give --serial TEXT, too: which one is the first"
           : !strcmp(options->second, options->serial) ? "--second: it is the bridge of --serial; give another one"
           : whisker_settings_check(&second, NULL, 0)
               ? "--second-lane-mask: it has lanes above 27; use bits of 0xfffffff"
           : second.tick_period < WHISKER_PAIR_PERIOD_MIN
               ? "--second: ticks of two bridges can be matched from a --tick-period of 22500 on; give 22500 or more"
               : NULL;
}

static int daemon_options_check(const struct daemon_options *options, bool word_too_many)
{
    char message[128];
    if (word_too_many || (!options->ring && !options->list)) {
        fprintf(stderr, DAEMON_PROGRAM ": %s; see " DAEMON_PROGRAM " --help\n",
                word_too_many ? "there is a word too many" : "--ring NAME is missing");
        return CLI_USAGE;
    }
    if (whisker_settings_check(&options->settings, message, sizeof message) != 0) {
        fprintf(stderr, DAEMON_PROGRAM ": %s\n", message);
        return CLI_USAGE;
    }
    const char *wrong = daemon_options_check_second(options);
    if (wrong) {
        fprintf(stderr, DAEMON_PROGRAM ": %s\n", wrong);
        return CLI_USAGE;
    }
    return -1;
}

int daemon_options_parse(int argc, char **argv, struct daemon_options *options)
{
    static const struct option known[] = {
        {"ring", required_argument, NULL, 'r'},
        {"serial", required_argument, NULL, 's'},
        {"second", required_argument, NULL, '2'},
        {"second-lane-mask", required_argument, NULL, NUMBER},
        {"ring-frames", required_argument, NULL, NUMBER},
        {"lane-mask", required_argument, NULL, NUMBER},
        {"tick-period", required_argument, NULL, NUMBER},
        {"sck-divider", required_argument, NULL, NUMBER},
        {"word-gap", required_argument, NULL, NUMBER},
        {"sample-point", required_argument, NULL, NUMBER},
        {"batch", required_argument, NULL, NUMBER},
        {"tick-in", required_argument, NULL, 't'},
        {"every-frame", no_argument, NULL, 'e'},
        {"pattern", no_argument, NULL, 'p'},
        {"list", no_argument, NULL, 'l'},
        {"wait", no_argument, NULL, 'w'},
        {"once", no_argument, NULL, 'o'},
        {"replace", no_argument, NULL, 'x'},
        {"verbose", no_argument, NULL, 'v'},
        {"help", no_argument, NULL, 'h'},
        {NULL, 0, NULL, 0},
    };
    *options = (struct daemon_options){.frames = WHISKER_RING_FRAMES};
    whisker_settings_default(&options->settings);
    options->second_lane_mask = options->settings.lane_mask;
    int which = 0;
    for (int option; (option = getopt_long(argc, argv, "", known, &which)) != -1;) {
        if (option == 'h') {
            daemon_options_print_help(&options->settings);
            return CLI_OK;
        }
        if (!(option == NUMBER ? daemon_options_set_number(options, known[which].name, optarg)
                               : daemon_options_set_word(options, option, optarg))) {
            return CLI_USAGE;
        }
    }
    return daemon_options_check(options, optind != argc);
}
