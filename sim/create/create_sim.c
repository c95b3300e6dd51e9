/* whisker-create-sim: the emulator on a pseudo-terminal, paced by the wall clock. See --help. */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include "command_line.h"
#include "create_ground.h"
#include "create_pty.h"
#include "whisker_protocol.h"

#define PROGRAM "whisker-create-sim"

enum {
    FAILED = 1,
    WRONG_USE = 2,
    TICKS_PER_S = WHISKER_LIMIT_CLOCK_HZ / WHISKER_LIMIT_TICK_PERIOD,
    WAKE_NS = 1000000,        /* between two looks at the line */
    BEHIND_MAX = TICKS_PER_S, /* a machine that slept for longer does not catch up */
    OPTIONS_MAX = 24,
    LINE_SIZE = 512
};

struct settings {
    struct sim_create_options robot;
    const char *link, *arena;
};

struct emulator {
    sim_create *create;
    sim_world *world;
    struct create_pty pty;
    int timer, signals;
    enum create_oi_mode mode; /* as printed last */
    uint64_t ticks;
};

static int create_sim_complain(int code, const char *text)
{
    fprintf(stderr, PROGRAM ": %s\n", text);
    return code;
}

static bool create_sim_set_seed(void *settings, const char *name, const char *text)
{
    char *end;
    errno = 0;
    ((struct settings *)settings)->robot.seed = strtoull(text, &end, 10);
    return (!errno && end != text && !*end && text[0] != '-') ||
           command_line_refuse(PROGRAM, name, text, "give a whole number from 0 on");
}

static bool create_sim_set_model(void *settings, const char *name, const char *text)
{
    ((struct settings *)settings)->robot.version = text[0] == '1' ? CREATE_OI_V2 : CREATE_OI_V3;
    return !strcmp(text, "1") || !strcmp(text, "2") || command_line_refuse(PROGRAM, name, text, "give 1 or 2");
}

static bool create_sim_set_robot(void *settings, const char *name, const char *text)
{
    char error[LINE_SIZE] = "--";
    if (!sim_create_set(&((struct settings *)settings)->robot, name, text, error + 2, sizeof error - 2))
        return true;
    create_sim_complain(WRONG_USE, error);
    return false;
}

static const struct command_option OWN[] = {
    {"model", "1|2", "Create 1 (57600 baud) or Create 2 (115200 baud) (1)", COMMAND_OWN, 0, 0, 0, create_sim_set_model},
    {"link", "PATH", "make a symbolic link to the pseudo-terminal", COMMAND_TEXT, offsetof(struct settings, link), 0, 0,
     NULL},
    {"arena", "FLAT", "flat scene file of its surroundings, with walls to bump into (an open floor)", COMMAND_TEXT,
     offsetof(struct settings, arena), 0, 0, NULL},
    {"seed", "N", "seed of the wheels' errors and of the line's faults (1)", COMMAND_OWN, 0, 0, 0, create_sim_set_seed},
};

/* The program's options, and behind them the robot's: how many. */
static size_t create_sim_list_options(struct command_option options[OPTIONS_MAX])
{
    const char *name, *value, *help;
    size_t count = sizeof OWN / sizeof OWN[0];
    memcpy(options, OWN, sizeof OWN);
    for (size_t i = 0; count < OPTIONS_MAX && sim_create_describe(i, &name, &value, &help); i++)
        options[count++] = (struct command_option){name, value, help, COMMAND_OWN, 0, 0, 0, create_sim_set_robot};
    return count;
}

/* Returns COMMAND_LINE_READ, or the exit code. */
static int create_sim_read_options(int argc, char **argv, struct settings *settings)
{
    struct command_option options[OPTIONS_MAX];
    const struct command_line line = {
        .program = PROGRAM,
        .usage = "Usage: " PROGRAM " [OPTION...]\n"
                 "Emulates an iRobot Create on a pseudo-terminal, in real time, until SIGINT or SIGTERM. A driver "
                 "opens the\n"
                 "printed path, or the link, as its serial port. Each change of mode is printed,\n"
                 "and at the end where the robot stands.\n",
        .notes = "Example: " PROGRAM " --link /tmp/create --model 2\n"
                 "Example: " PROGRAM " --link /tmp/create --drop-remainder --lose-bytes 0.001\n"
                 "Example: " PROGRAM " --link /tmp/create --event bump-left@3s --event silent@10s+2s\n"
                 "Exit code: 0 stopped on request, 1 failed, 2 wrong use.\n",
        .option = options,
        .count = create_sim_list_options(options),
    };
    int rest, result = command_line_read(&line, argc, argv, settings, &rest);
    return result == COMMAND_LINE_READ && rest < argc ? command_line_wrong(PROGRAM, "takes options only") : result;
}

static sim_world *create_sim_make_world(const struct settings *settings, char *error, size_t size)
{
    static const char OPEN_FLOOR[] = "size_m 1000 1000\ntile_m 1000\ntexture SMOOTH\nfloor S\n"
                                     "body_radius_m 0.165\nstart 500 500 0\n";
    struct sim_scene scene;
    int result = settings->arena ? sim_scene_read(settings->arena, &scene, error, size)
                                 : sim_scene_parse(OPEN_FLOOR, "open floor", &scene, error, size);
    if (result)
        return NULL;
    sim_world *world = sim_world_new(&scene, settings->robot.seed);
    if (!world)
        snprintf(error, size, "no memory for a world; free some");
    return world;
}

static int create_sim_open_signals(void)
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    sigprocmask(SIG_BLOCK, &set, NULL);
    return signalfd(-1, &set, SFD_CLOEXEC);
}

static int create_sim_open_timer(void)
{
    const struct itimerspec every = {{0, WAKE_NS}, {0, WAKE_NS}};
    int timer = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC);
    if (timer >= 0)
        timerfd_settime(timer, 0, &every, NULL);
    return timer;
}

static void create_sim_report_mode(struct emulator *emulator)
{
    static const char *const NAMES[] = {"off", "passive", "safe", "full"};
    enum create_oi_mode mode = sim_create_mode(emulator->create);
    if (mode == emulator->mode)
        return;
    emulator->mode = mode;
    printf("%.3f s: mode %s\n", (double)emulator->ticks / TICKS_PER_S, NAMES[mode]);
    fflush(stdout);
}

/* Where the robot truly stands; on an open floor it begins at 500 m, 500 m, 0. */
static void create_sim_report_pose(const struct emulator *emulator)
{
    const struct sim_pose pose = sim_world_pose(emulator->world);
    printf("%.3f s: at %.6f m, %.6f m, %.6f rad\n", (double)emulator->ticks / TICKS_PER_S, pose.x, pose.y, pose.theta);
}

/* Bytes in, one tick, bytes out. */
static void create_sim_step(struct emulator *emulator)
{
    uint8_t bytes[LINE_SIZE];
    const size_t room = SIM_CREATE_IN_MAX - sim_create_queued(emulator->create);
    size_t count = create_pty_read(&emulator->pty, bytes, room < sizeof bytes ? room : sizeof bytes);
    sim_create_receive(emulator->create, bytes, count);
    create_sim_report_mode(emulator);
    create_ground_drive(emulator->create, emulator->world);
    sim_world_step(emulator->world);
    create_ground_tick(emulator->create, emulator->world);
    emulator->ticks++;
    create_sim_report_mode(emulator);
    while ((count = sim_create_take(emulator->create, bytes, sizeof bytes)) > 0)
        create_pty_write(&emulator->pty, bytes, count);
}

static void create_sim_run(struct emulator *emulator)
{
    struct pollfd wake[] = {{emulator->timer, POLLIN, 0}, {emulator->signals, POLLIN, 0}};
    while (poll(wake, 2, -1) > 0 && !wake[1].revents) {
        uint64_t wakes = 0;
        if (read(emulator->timer, &wakes, sizeof wakes) != sizeof wakes)
            continue;
        uint64_t due = wakes * WAKE_NS / (1000000000u / TICKS_PER_S);
        for (uint64_t i = 0; i < due && i < BEHIND_MAX; i++)
            create_sim_step(emulator);
    }
}

static int create_sim_emulate(const struct settings *settings)
{
    char error[LINE_SIZE] = "no memory for a robot; free some";
    struct emulator emulator = {.world = create_sim_make_world(settings, error, sizeof error)};
    int result = FAILED;
    emulator.create = emulator.world ? sim_create_new(&settings->robot) : NULL;
    if (emulator.create && !create_pty_open(&emulator.pty, settings->link, error, sizeof error)) {
        emulator.signals = create_sim_open_signals();
        emulator.timer = create_sim_open_timer();
        printf("Create %d at %s\n", settings->robot.version == CREATE_OI_V2 ? 1 : 2,
               settings->link ? settings->link : emulator.pty.path);
        fflush(stdout);
        create_sim_run(&emulator);
        create_sim_report_pose(&emulator);
        create_pty_close(&emulator.pty);
        result = 0;
    } else {
        create_sim_complain(FAILED, error);
    }
    sim_create_free(emulator.create);
    sim_world_free(emulator.world);
    return result;
}

int main(int argc, char **argv)
{
    struct settings settings = {.robot = sim_create_defaults(CREATE_OI_V2)};
    int result = create_sim_read_options(argc, argv, &settings);
    return result == COMMAND_LINE_READ ? create_sim_emulate(&settings) : result;
}
