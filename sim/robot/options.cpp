#include "options.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr double TICKS_PER_SECOND = static_cast<double>(WHISKER_LIMIT_CLOCK_HZ) / WHISKER_LIMIT_TICK_PERIOD;
constexpr double SECONDS_MAX = 86400;
constexpr double PACE_MAX = 100;
constexpr size_t BENCH_LANES = 6;

Options &of(void *options)
{
    return *static_cast<Options *>(options);
}

template <std::string Options::*FIELD> bool set_text(void *options, const char *, const char *text)
{
    of(options).*FIELD = text;
    return true;
}

template <bool Options::*FIELD> bool set_flag(void *options, const char *, const char *)
{
    return of(options).*FIELD = true;
}

template <auto FIELD, uint32_t LEAST, uint32_t MOST> bool set_number(void *options, const char *name, const char *text)
{
    uint32_t value = 0;
    const bool right = command_line_number(PROGRAM, name, text, LEAST, MOST, &value);
    of(options).*FIELD = value;
    return right;
}

template <uint8_t BenchSettings::*FIELD, uint32_t LEAST, uint32_t MOST>
bool set_link(void *options, const char *name, const char *text)
{
    uint32_t value = 0;
    const bool right = command_line_number(PROGRAM, name, text, LEAST, MOST, &value);
    of(options).link.*FIELD = static_cast<uint8_t>(value);
    return right;
}

bool refuse_unless_positive(const char *name, const char *text, double most, const char *what, double *value)
{
    char *end = nullptr;
    *value = std::strtod(text, &end);
    const bool right = end != text && *end == '\0' && std::isfinite(*value) && *value > 0 && *value <= most;
    return right || command_line_refuse(PROGRAM, name, text, what);
}

bool set_seconds(void *options, const char *name, const char *text)
{
    return refuse_unless_positive(name, text, SECONDS_MAX, "give simulated seconds, more than 0, at most 86400",
                                  &of(options).seconds);
}

bool set_pace(void *options, const char *name, const char *text)
{
    return refuse_unless_positive(name, text, PACE_MAX, "give simulated seconds per second, more than 0, at most 100",
                                  &of(options).pace);
}

bool set_rtl_seconds(void *options, const char *name, const char *text)
{
    double seconds = 0;
    const bool right =
        refuse_unless_positive(name, text, SECONDS_MAX, "give simulated seconds, more than 0, at most 86400", &seconds);
    of(options).link.rtl_ticks = static_cast<uint64_t>(std::llround(seconds * TICKS_PER_SECOND));
    return right;
}

bool set_defect(void *options, const char *name, const char *text)
{
    try {
        of(options).defect = Defect::parse(text);
        return true;
    } catch (const std::exception &error) {
        return command_line_refuse(PROGRAM, name, text, error.what());
    }
}

bool set_level(void *options, const char *name, const char *text)
{
    const std::string level = text;
    of(options).link.level = level == "rtl" ? Level::RTL : Level::MIXED;
    return level == "rtl" || level == "bytes" || level == "mixed" ||
           command_line_refuse(PROGRAM, name, text, "give rtl, bytes or mixed");
}

bool set_usbip(void *options, const char *name, const char *text)
{
    uint32_t port = 0;
    of(options).usbip = true;
    const bool right = command_line_number(PROGRAM, name, text, 0, UINT16_MAX, &port);
    of(options).port = static_cast<uint16_t>(port);
    return right;
}

command_option own(const char *name, const char *value, const char *help,
                   bool (*set)(void *options, const char *name, const char *text))
{
    return {name, value, help, COMMAND_OWN, 0, 0, 0, set};
}

constexpr size_t MESSAGE_BYTES = 512;
const char PREFIX[] = "create-";

CreateOptions &create_of(void *options)
{
    return static_cast<Options *>(options)->create;
}

bool set_create(void *options, const char *name, const char *text)
{
    create_of(options).robot.version = text[0] == '1' ? CREATE_OI_V2 : CREATE_OI_V3;
    create_of(options).on = true;
    return !std::strcmp(text, "1") || !std::strcmp(text, "2") ||
           command_line_refuse(PROGRAM, name, text, "give 1 or 2");
}

bool set_create_link(void *options, const char *, const char *text)
{
    create_of(options).link = text;
    return true;
}

bool set_create_trait(void *options, const char *name, const char *text)
{
    char error[MESSAGE_BYTES] = "";
    return sim_create_set(&create_of(options).robot, name + std::strlen(PREFIX), text, error, sizeof error) == 0 ||
           command_line_refuse(PROGRAM, name, text ? text : "", error);
}

// The names with "create-" before them, made once: the table keeps pointers to them.
const char *robot_name(const char *name)
{
    static std::deque<std::string> names;
    names.push_back(std::string(PREFIX) + name);
    return names.back().c_str();
}

// The options of the Create.
std::vector<command_option> create_command_options()
{
    std::vector<command_option> options = {
        {"create", "1|2", "the base is an iRobot Create behind a serial port; the pilot answers with 'base T N'",
         COMMAND_OWN, 0, 0, 0, set_create},
        {"create-link", "PATH", "where that port, a pseudo-terminal, is linked", COMMAND_OWN, 0, 0, 0, set_create_link},
    };
    const char *name = nullptr;
    const char *value = nullptr;
    const char *help = nullptr;
    for (size_t i = 0; sim_create_describe(i, &name, &value, &help); i++) {
        options.push_back({robot_name(name), value, help, COMMAND_OWN, 0, 0, 0, set_create_trait});
    }
    return options;
}

// All options, those of the Create among them.
std::vector<command_option> all_options()
{
    std::vector<command_option> all = {
        own("scene", "FLAT", "flat scene file: arena, robot, start pose", set_text<&Options::scene>),
        own("seconds", "S", "simulated length of the run", set_seconds),
        own("pace", "X", "at most X simulated seconds per second; the world then goes on while nobody takes\nframes",
            set_pace),
        own("seed", "N", "seed of world, sensors and faults (1)", set_number<&Options::seed, 0, UINT32_MAX>),
        own("socket", "PATH", "where followers and the pilot connect", set_text<&Options::socket>),
        own("followers", "K", "wait for so many of them, the pilot included (0)",
            set_number<&Options::followers, 0, LANES>),
        own("truth", "OUT.csv", "pose and texture tips after every 0.1 s", set_text<&Options::truth>),
        own("wheels", "OUT.csv", "each change of what the Create's wheels are ordered: tick, monotonic clock,\nspeeds",
            set_text<&Options::wheels>),
        own("faults", "OUT.csv", "inject lane and USB faults; log each spoilt lane,tick,kind",
            set_text<&Options::faults>),
        own("usb-faults", "OUT.csv", "log each USB fault: tick,kind", set_text<&Options::usb_faults>),
        own("fault-list", "FILE",
            "inject just these: lines 'lane TICK LANE KIND ARGUMENT', 'usb TICK KIND', ticks\nrising, and 'lasting "
            "TICK UNTIL LANE KIND'",
            set_text<&Options::fault_list>),
        own("nodes", "FILE", "single nodes' traits: lines 'LANE serial N', 'LANE chip ID', 'LANE cut BLOCK'",
            set_text<&Options::nodes>),
        own("flash", "FILE", "the configuration flash (1 MiB), made if it is not there; a gateware update\nchanges it",
            set_text<&Options::flash>),
        own("flash-cut", "N", "power goes in the midst of the write to it after N; the run ends",
            set_number<&Options::flash_cut, 0, UINT32_MAX>),
        own("lanes-populated", "N",
            "nodes on the first N lanes; those without a whisker are at rest (the scene's;\nbench: 6)",
            set_number<&Options::lanes_populated, 1, LANES>),
        own("speed-report", "OUT.json", "ticks, clock cycles, wall seconds, fault counts",
            set_text<&Options::speed_report>),
        own("defect", "KIND", "misbehave: wire-version (claims another), frame (damages one) or truncate (cuts\none)",
            set_defect),
        own("level", "rtl|bytes|mixed",
            "the Verilated bridge, cycle by cycle; or that around requests and faults, and its\nmodel of bytes "
            "in between: the same frames (rtl)",
            set_level),
        own("rtl-seconds", "S", "level mixed: cycle by cycle for the first S simulated seconds (0)", set_rtl_seconds),
        own("usbip", "PORT", "serve the device by USB/IP on this port of 127.0.0.1 (0: a free one, which is\nprinted)",
            set_usbip),
        own("unplugged", nullptr, "begin without the bridge, until 'plug' comes by the socket",
            set_flag<&Options::unplugged>),
        own("progress", nullptr, "a line 'progress TICK TICKS' every simulated second (default on a terminal)",
            set_flag<&Options::progress>),
        own("bench", nullptr, "no COMMAND, no umockdev: an internal host reads and checks every frame",
            set_flag<&Options::bench>),
        own("sck-divider", "N", "bench: node link, in cycles of 60 MHz (6)",
            set_link<&BenchSettings::sck_divider, WHISKER_LIMIT_SCK_DIVIDER_MIN, WHISKER_LIMIT_SCK_DIVIDER_MAX>),
        own("word-gap", "N", "bench: the same (30)",
            set_link<&BenchSettings::word_gap, WHISKER_LIMIT_WORD_GAP_MIN, UINT8_MAX>),
        own("sample-point", "N", "bench: the same (5)",
            set_link<&BenchSettings::sample_point, 1, WHISKER_LIMIT_SCK_DIVIDER_MAX>),
    };
    const std::vector<command_option> create = create_command_options();
    all.insert(all.end(), create.begin(), create.end());
    return all;
}

const char USAGE[] =
    "usage: umockdev-wrapper whisker-bridge-sim --scene FLAT --seconds S [options] -- COMMAND...\n"
    "       whisker-bridge-sim --scene FLAT --seconds S --usbip PORT [options]\n"
    "       whisker-bridge-sim --bench --seconds S [options]\n"
    "\n"
    "Simulates robot, nodes and bridge (RTL) as a USB device that COMMAND, and only it, sees, or a Linux kernel. No\n"
    "tick is produced before the earlier ones are taken, so the same seed gives the same frames on any machine.\n";

const char NOTES[] =
    "Exit code: COMMAND's (0 for a device that was served until a signal came); 1 if the run could not be completed;\n"
    "2 for a wrong command line.\n"
    "\n"
    "example: umockdev-wrapper whisker-bridge-sim --scene arena.flat --seconds 10 --seed 7 --faults faults.csv \\\n"
    "             -- whiskerd --ring demo --sck-divider 6 --word-gap 30 --sample-point 5\n";

void require(bool ok, const char *message)
{
    if (!ok) {
        throw std::runtime_error(message);
    }
}

void check(const Options &options)
{
    require(options.seconds > 0, "--seconds is missing: say how long the run is, for example --seconds 10");
    require(options.link.sample_point <= options.link.sck_divider, "--sample-point is beyond --sck-divider: lower it");
    require(options.usb_faults.empty() || !options.faults.empty(), "--usb-faults needs --faults: give both or neither");
    if (options.bench) {
        require(options.command.empty(), "--bench runs no command: leave out what stands after --");
        require(!options.usbip, "--bench has a host of its own: leave out --usbip");
        return;
    }
    require(!options.scene.empty(), "--scene is missing: give a flat scene file, or --bench");
    require(options.usbip || !options.command.empty(),
            "the command is missing: give it after --, for example -- whiskerd --ring demo");
    require(!options.usbip || options.command.empty(),
            "a device that is served has no command here: leave out what stands after --");
    require(!options.unplugged || !options.socket.empty(), "--unplugged needs --socket: say where 'plug' comes from");
    require(options.create.on || options.create.link.empty(), "--create-link needs --create: say which model, 1 or 2");
    require(!options.create.on || !options.create.link.empty(),
            "--create needs --create-link: say where its serial port is to be linked");
    require(options.create.on || options.wheels.empty(), "--wheels needs --create: say which model, 1 or 2");
    require(options.followers == 0 || !options.socket.empty(), "--followers needs --socket: say where they connect");
}

} // namespace

uint64_t Options::ticks() const
{
    return static_cast<uint64_t>(std::llround(seconds * TICKS_PER_SECOND));
}

int parse_options(int argc, char **argv, Options &options)
{
    const std::vector<command_option> all = all_options();
    const command_line line = {PROGRAM, USAGE, NOTES, all.data(), all.size(), true};
    int rest = 0;
    const int result = command_line_read(&line, argc, argv, &options, &rest);
    if (result != COMMAND_LINE_READ) {
        return result;
    }
    options.command.assign(argv + rest, argv + argc);
    try {
        check(options);
    } catch (const std::runtime_error &error) {
        std::fprintf(stderr, "%s: %s\n", PROGRAM, error.what());
        return COMMAND_LINE_WRONG;
    }
    if (options.bench && options.lanes_populated == 0) {
        options.lanes_populated = BENCH_LANES;
    }
    return result;
}

} // namespace bridge_sim
