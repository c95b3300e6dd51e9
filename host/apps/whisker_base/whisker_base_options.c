#include "whisker_base_options.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "command_line.h"
#include "create/port.h"
#include "daemon_log.h"

#define AT(field) offsetof(struct base_options, field)

/* Reads an option that is one of two words. */
static bool whisker_base_options_set_choice(const char *option, const char *text, const char *no, const char *yes,
                                            bool *value)
{
    *value = !strcmp(text, yes);
    char remedy[64];
    snprintf(remedy, sizeof remedy, "give %s or %s", no, yes);
    return *value || !strcmp(text, no) || command_line_refuse(DAEMON_PROGRAM, option, text, remedy);
}

static bool whisker_base_options_set_policy(void *options, const char *name, const char *text)
{
    enum create_source *policy = &((struct base_options *)options)->odometry.policy;
    for (*policy = CREATE_REPORTED; *policy < CREATE_AUTO && strcmp(text, create_source_name(*policy)) != 0;) {
        *policy = (enum create_source)(*policy + 1);
    }
    return !strcmp(text, create_source_name(*policy)) ||
           command_line_refuse(DAEMON_PROGRAM, name, text, "give auto, reported, requested or encoders");
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

static bool whisker_base_options_set_number(void *options, const char *name, const char *text)
{
    double *value = whisker_base_options_number_named(&((struct base_options *)options)->odometry, name);
    char *end;
    errno = 0;
    *value = strtod(text, &end);
    struct create_odometry_settings probe;
    create_odometry_defaults(&probe, CREATE_1);
    *whisker_base_options_number_named(&probe, name) = *value;
    return (end != text && *end == '\0' && errno == 0 && create_odometry_check(&probe)) ||
           command_line_refuse(DAEMON_PROGRAM, name, text, "give a positive number");
}

static bool whisker_base_options_set_baud(void *options, const char *name, const char *text)
{
    uint32_t *baud = &((struct base_options *)options)->baud;
    return command_line_number(DAEMON_PROGRAM, name, text, 1, UINT32_MAX, baud) &&
           (create_port_knows(*baud) ||
            command_line_refuse(DAEMON_PROGRAM, name, text, "give 57600, 115200 or another speed of a Create"));
}

static bool whisker_base_options_set_model(void *options, const char *name, const char *text)
{
    bool second;
    const bool right = whisker_base_options_set_choice(name, text, "1", "2", &second);
    ((struct base_options *)options)->odometry.model = second ? CREATE_2 : CREATE_1;
    return right;
}

static bool whisker_base_options_set_mode(void *options, const char *name, const char *text)
{
    return whisker_base_options_set_choice(name, text, "safe", "full", &((struct base_options *)options)->full);
}

static bool whisker_base_options_set_clock(void *options, const char *name, const char *text)
{
    bool *stream = &((struct base_options *)options)->stream_clock;
    return whisker_base_options_set_choice(name, text, "wall", "stream", stream);
}

#define OWN(name, value, help, set)                                                                                    \
    {                                                                                                                  \
        name, value, help, COMMAND_OWN, 0, 0, 0, whisker_base_options_set_##set                                        \
    }

static const struct command_option OPTIONS[] = {
    {"port", "PATH", "serial port, or the link of an emulator", COMMAND_TEXT, AT(port), 0, 0, NULL},
    {"socket", "PATH", "Unix socket to make (messages: docs/create.md)", COMMAND_TEXT, AT(socket), 0, 0, NULL},
    OWN("model", "1|2", "Create 1, or Create 2 and Roomba 600 (1)", model),
    OWN("baud", "N", "speed of the line (57600 for model 1, 115200 for model 2)", baud),
    OWN("mode", "safe|full", "safe: the base stops at cliffs, wheel drops and its charger (safe)", mode),
    OWN("clock", "wall|stream", "what the dead-man counts: time, or frames of 15 ms, for lock-step simulation (wall)",
        clock),
    OWN("odometry", "POLICY", "auto, reported, requested, encoders (auto)", policy),
    OWN("wheel-base", "M", "between the wheels, in m (the model's)", number),
    OWN("distance-scale", "X", "true distance over reported distance (1)", number),
    OWN("angle-scale", "X", "true angle over reported angle (1)", number),
    OWN("relative-sigma", "X", "standard deviation of these two scales (0.05)", number),
    OWN("requested-sigma", "X", "the same where requested speeds are integrated (0.1)", number),
    OWN("drift", "RAD_PER_M", "standard deviation of the heading per distance (0.05)", number),
    {"brc", NULL, "the cable leads RTS to the base's BRC pin: a pulse each minute keeps it awake", COMMAND_FLAG,
     AT(brc), 0, 0, NULL},
    {"wait", NULL, "wait for the port instead of failing when there is none", COMMAND_FLAG, AT(wait), 0, 0, NULL},
    {"verbose", NULL, "log successful steps, too", COMMAND_FLAG, AT(verbose), 0, 0, NULL},
};

static const struct command_line LINE = {
    .program = DAEMON_PROGRAM,
    .usage =
        "Usage: " DAEMON_PROGRAM " --port PATH --socket PATH [OPTION...]\n"
        "Drives an iRobot Create over its serial port and serves it on a Unix socket, until SIGTERM or SIGINT. Wheels\n"
        "stop when the commander is silent for 0.3 s or gone, when a process of the driver dies, and at the end.\n",
    .notes =
        "Under systemd: notifies readiness, feeds the watchdog. WHISKER_HEARTBEAT_FD: a pipe of the supervisor that "
        "is\n"
        "watched; the wheels stop when it is silent for 0.3 s, and at its end whisker-base ends (docs/create.md).\n\n"
        "Example: " DAEMON_PROGRAM " --port /dev/ttyUSB0 --socket /run/user/1000/base\n"
        "Example: " DAEMON_PROGRAM " --port /dev/ttyUSB0 --socket base.sock --model 2 --wait --mode full\n"
        "Exit code: 0 stopped on request, 1 failed, 2 wrong use.\n",
    .option = OPTIONS,
    .count = sizeof OPTIONS / sizeof *OPTIONS,
};

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
    return wrong ? command_line_wrong(DAEMON_PROGRAM, wrong) : COMMAND_LINE_READ;
}

int base_options_parse(int argc, char **argv, struct base_options *options)
{
    *options = (struct base_options){0};
    create_odometry_defaults(&options->odometry, CREATE_1);
    options->odometry.wheel_base_m = 0; /* the model's */
    int rest;
    const int result = command_line_read(&LINE, argc, argv, options, &rest);
    return result == COMMAND_LINE_READ ? whisker_base_options_check(options, rest != argc) : result;
}
