#include "whisker_base_options.h"

#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "create/port.h"
#include "daemon_log.h"

static void whisker_base_options_print_help(void)
{
    printf(
        "Usage: " DAEMON_PROGRAM " --port PATH --socket PATH [OPTION...]\n"
        "Drives an iRobot Create over its serial port and serves it on a Unix socket, until SIGTERM or SIGINT. Wheels\n"
        "stop when the commander is silent for 0.3 s or gone, when a process of the driver dies, and at the end.\n\n"
        "  --port PATH         serial port, or the link of an emulator\n"
        "  --socket PATH       Unix socket to make (messages: docs/create.md)\n"
        "  --model 1|2         Create 1, or Create 2 and Roomba 600 (1)\n"
        "  --baud N            speed of the line (57600 for model 1, 115200 for model 2)\n"
        "  --mode safe|full    safe: the base stops at cliffs, wheel drops and its charger (safe)\n"
        "  --clock wall|stream what the dead-man counts: time, or frames of 15 ms, for lock-step simulation (wall)\n"
        "  --odometry POLICY   auto, reported, requested, encoders (auto)\n"
        "  --wheel-base M      between the wheels, in m (%g for model 1, %g for model 2)\n"
        "  --distance-scale X  true distance over reported distance (1)\n"
        "  --angle-scale X     true angle over reported angle (1)\n"
        "  --relative-sigma X  standard deviation of these two scales (0.05)\n"
        "  --requested-sigma X the same where requested speeds are integrated (0.1)\n"
        "  --drift RAD_PER_M   standard deviation of the heading per distance (0.05)\n"
        "  --wait              wait for the port instead of failing when there is none\n"
        "  --verbose           tell also what goes well\n"
        "  --help              this text\n\n"
        "Under systemd: notifies readiness, feeds the watchdog. WHISKER_HEARTBEAT_FD: a pipe of the supervisor that "
        "is\n"
        "watched; the wheels stop when it is silent for 0.3 s, and at its end whisker-base ends (docs/create.md).\n\n"
        "Example: " DAEMON_PROGRAM " --port /dev/ttyUSB0 --socket /run/user/1000/base\n"
        "Example: " DAEMON_PROGRAM " --port /dev/ttyUSB0 --socket base.sock --model 2 --wait --mode full\n"
        "Exit code: 0 stopped on request, 1 failed, 2 wrong use.\n",
        create_model_facts(CREATE_1)->wheel_base_m, create_model_facts(CREATE_2)->wheel_base_m);
}

static bool whisker_base_options_refuse(const char *option, const char *text, const char *remedy)
{
    fprintf(stderr, DAEMON_PROGRAM ": --%s %s: %s\n", option, text, remedy);
    return false;
}

/* Reads an option that is one of two words. */
static bool whisker_base_options_set_choice(const char *option, const char *text, const char *no, const char *yes,
                                            bool *value)
{
    *value = !strcmp(text, yes);
    char remedy[64];
    snprintf(remedy, sizeof remedy, "give %s or %s", no, yes);
    return *value || !strcmp(text, no) || whisker_base_options_refuse(option, text, remedy);
}

static bool whisker_base_options_set_policy(const char *text, enum create_source *policy)
{
    for (*policy = CREATE_REPORTED; *policy < CREATE_AUTO && strcmp(text, create_source_name(*policy)) != 0;) {
        *policy = (enum create_source)(*policy + 1);
    }
    return !strcmp(text, create_source_name(*policy)) ||
           whisker_base_options_refuse("odometry", text, "give auto, reported, requested or encoders");
}

/* Number options, by name. A model's own values are filled in when the command line has been read. */
static double *whisker_base_options_number_named(struct create_odometry_settings *settings, const char *name)
{
    return !strcmp(name, "wheel-base")        ? &settings->wheel_base_m
           : !strcmp(name, "distance-scale")  ? &settings->distance_scale
           : !strcmp(name, "angle-scale")     ? &settings->angle_scale
           : !strcmp(name, "relative-sigma")  ? &settings->relative_sigma
           : !strcmp(name, "requested-sigma") ? &settings->requested_sigma
                                              : &settings->drift_rad_per_m;
}

static bool whisker_base_options_set_number(struct base_options *options, const char *name, const char *text)
{
    double *value = whisker_base_options_number_named(&options->odometry, name);
    char *end;
    errno = 0;
    *value = strtod(text, &end);
    struct create_odometry_settings probe;
    create_odometry_defaults(&probe, CREATE_1);
    *whisker_base_options_number_named(&probe, name) = *value;
    return (end != text && *end == '\0' && errno == 0 && create_odometry_check(&probe)) ||
           whisker_base_options_refuse(name, text, "give a positive number");
}

enum { MODEL = 'm', BAUD = 'b', MODE = 'o', CLOCK = 'c', POLICY = 'y', NUMBER = 'n' };

static const struct option known[] = {
    {"port", required_argument, NULL, 'p'},
    {"socket", required_argument, NULL, 's'},
    {"model", required_argument, NULL, MODEL},
    {"baud", required_argument, NULL, BAUD},
    {"mode", required_argument, NULL, MODE},
    {"clock", required_argument, NULL, CLOCK},
    {"odometry", required_argument, NULL, POLICY},
    {"wheel-base", required_argument, NULL, NUMBER},
    {"distance-scale", required_argument, NULL, NUMBER},
    {"angle-scale", required_argument, NULL, NUMBER},
    {"relative-sigma", required_argument, NULL, NUMBER},
    {"requested-sigma", required_argument, NULL, NUMBER},
    {"drift", required_argument, NULL, NUMBER},
    {"wait", no_argument, NULL, 'w'},
    {"verbose", no_argument, NULL, 'v'},
    {"help", no_argument, NULL, 'h'},
    {NULL, 0, NULL, 0},
};

static bool whisker_base_options_set_baud(struct base_options *options, const char *text)
{
    return cli_number(DAEMON_PROGRAM, "baud", text, 1, UINT32_MAX, &options->baud) &&
           (create_port_knows(options->baud) ||
            whisker_base_options_refuse("baud", text, "give 57600, 115200 or another speed of a Create"));
}

static bool whisker_base_options_set_model(struct base_options *options, const char *text)
{
    bool second;
    const bool right = whisker_base_options_set_choice("model", text, "1", "2", &second);
    options->odometry.model = second ? CREATE_2 : CREATE_1;
    return right;
}

static bool whisker_base_options_set_word(struct base_options *options, int option, const char *text)
{
    switch (option) {
    case 'p':
        options->port = text;
        return true;
    case 's':
        options->socket = text;
        return true;
    case 'w':
        return options->wait = true;
    case 'v':
        return options->verbose = true;
    case MODEL:
        return whisker_base_options_set_model(options, text);
    case BAUD:
        return whisker_base_options_set_baud(options, text);
    case MODE:
        return whisker_base_options_set_choice("mode", text, "safe", "full", &options->full);
    case CLOCK:
        return whisker_base_options_set_choice("clock", text, "wall", "stream", &options->stream_clock);
    case POLICY:
        return whisker_base_options_set_policy(text, &options->odometry.policy);
    default:
        return false;
    }
}

static int whisker_base_options_check(struct base_options *options, bool word_too_many)
{
    const struct create_model_facts *facts = create_model_facts(options->odometry.model);
    options->odometry.wheel_base_m =
        options->odometry.wheel_base_m > 0 ? options->odometry.wheel_base_m : facts->wheel_base_m;
    options->baud = options->baud > 0 ? options->baud : facts->baud;
    const char *wrong = word_too_many      ? "there is a word too many"
                        : !options->port   ? "--port PATH is missing"
                        : !options->socket ? "--socket PATH is missing"
                        : !create_odometry_check(&options->odometry)
                            ? "a Create 1 has no encoders; choose another --odometry"
                            : NULL;
    if (wrong) {
        fprintf(stderr, DAEMON_PROGRAM ": %s; see " DAEMON_PROGRAM " --help\n", wrong);
        return CLI_USAGE;
    }
    return -1;
}

int base_options_parse(int argc, char **argv, struct base_options *options)
{
    *options = (struct base_options){0};
    create_odometry_defaults(&options->odometry, CREATE_1);
    options->odometry.wheel_base_m = 0; /* the model's */
    int which = 0;
    for (int option; (option = getopt_long(argc, argv, "", known, &which)) != -1;) {
        if (option == 'h') {
            whisker_base_options_print_help();
            return CLI_OK;
        }
        if (!(option == NUMBER ? whisker_base_options_set_number(options, known[which].name, optarg)
                               : whisker_base_options_set_word(options, option, optarg))) {
            return CLI_USAGE;
        }
    }
    return whisker_base_options_check(options, optind != argc);
}
