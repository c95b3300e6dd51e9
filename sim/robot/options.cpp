#include "options.h"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include <getopt.h>

namespace bridge_sim
{

namespace
{

constexpr double TICKS_PER_SECOND = static_cast<double>(WHISKER_LIMIT_CLOCK_HZ) / WHISKER_LIMIT_TICK_PERIOD;
constexpr double SECONDS_MAX = 86400;
constexpr double PACE_MAX = 100;
constexpr size_t BENCH_LANES = 6;

enum Option {
    HELP = 256,
    BENCH,
    PROGRESS,
    UNPLUGGED,
    SCENE,
    SEED,
    SECONDS,
    PACE,
    SOCKET,
    TRUTH,
    WHEELS,
    FAULTS,
    USB_FAULTS,
    FAULT_LIST,
    NODES,
    FLASH,
    FLASH_CUT,
    FOLLOWERS,
    LANES_POPULATED,
    SCK_DIVIDER,
    WORD_GAP,
    SAMPLE_POINT,
    SPEED_REPORT,
    DEFECT,
    LEVEL,
    USBIP,
    USBREDIR
};

const option LONG_OPTIONS[] = {{"help", no_argument, nullptr, HELP},
                               {"bench", no_argument, nullptr, BENCH},
                               {"progress", no_argument, nullptr, PROGRESS},
                               {"unplugged", no_argument, nullptr, UNPLUGGED},
                               {"scene", required_argument, nullptr, SCENE},
                               {"seed", required_argument, nullptr, SEED},
                               {"seconds", required_argument, nullptr, SECONDS},
                               {"pace", required_argument, nullptr, PACE},
                               {"socket", required_argument, nullptr, SOCKET},
                               {"truth", required_argument, nullptr, TRUTH},
                               {"wheels", required_argument, nullptr, WHEELS},
                               {"faults", required_argument, nullptr, FAULTS},
                               {"usb-faults", required_argument, nullptr, USB_FAULTS},
                               {"fault-list", required_argument, nullptr, FAULT_LIST},
                               {"nodes", required_argument, nullptr, NODES},
                               {"flash", required_argument, nullptr, FLASH},
                               {"flash-cut", required_argument, nullptr, FLASH_CUT},
                               {"followers", required_argument, nullptr, FOLLOWERS},
                               {"lanes-populated", required_argument, nullptr, LANES_POPULATED},
                               {"sck-divider", required_argument, nullptr, SCK_DIVIDER},
                               {"word-gap", required_argument, nullptr, WORD_GAP},
                               {"sample-point", required_argument, nullptr, SAMPLE_POINT},
                               {"speed-report", required_argument, nullptr, SPEED_REPORT},
                               {"defect", required_argument, nullptr, DEFECT},
                               {"level", required_argument, nullptr, LEVEL},
                               {"usbip", required_argument, nullptr, USBIP},
                               {"usbredir", required_argument, nullptr, USBREDIR}};

// All options, those of the Create among them, with the end that getopt wants.
std::vector<option> long_options()
{
    std::vector<option> options = create_long_options();
    options.insert(options.end(), std::begin(LONG_OPTIONS), std::end(LONG_OPTIONS));
    options.push_back({nullptr, 0, nullptr, 0});
    return options;
}

uint64_t whole_number(const char *name, const char *text, uint64_t least, uint64_t most)
{
    char *end = nullptr;
    errno = 0;
    const unsigned long long value = std::strtoull(text, &end, 10);
    if (errno != 0 || end == text || *end != '\0' || text[0] == '-' || value < least || value > most) {
        throw std::runtime_error(std::string("--") + name + " '" + text + "': give a whole number from " +
                                 std::to_string(least) + " to " + std::to_string(most));
    }
    return value;
}

double positive_number(const char *name, const char *text, const char *what, double most)
{
    char *end = nullptr;
    const double value = std::strtod(text, &end);
    if (end == text || *end != '\0' || !std::isfinite(value) || value <= 0 || value > most) {
        throw std::runtime_error(std::string("--") + name + " '" + text + "': give " + what +
                                 ", more than 0, at most " + std::to_string(static_cast<int>(most)));
    }
    return value;
}

std::string *path_of(Options &options, int option)
{
    switch (option) {
    case SCENE:
        return &options.scene;
    case SOCKET:
        return &options.socket;
    case TRUTH:
        return &options.truth;
    case WHEELS:
        return &options.wheels;
    case FAULTS:
        return &options.faults;
    case USB_FAULTS:
        return &options.usb_faults;
    case FAULT_LIST:
        return &options.fault_list;
    case NODES:
        return &options.nodes;
    case FLASH:
        return &options.flash;
    case SPEED_REPORT:
        return &options.speed_report;
    default:
        return nullptr;
    }
}

bool set_flag(Options &options, int option)
{
    bool *flag = option == HELP        ? &options.help
                 : option == BENCH     ? &options.bench
                 : option == PROGRESS  ? &options.progress
                 : option == UNPLUGGED ? &options.unplugged
                                       : nullptr;
    if (flag) {
        *flag = true;
    }
    return flag != nullptr;
}

void set_number(Options &options, int option, const char *text)
{
    BenchSettings &link = options.link;
    switch (option) {
    case SEED:
        options.seed = whole_number("seed", text, 0, UINT32_MAX);
        break;
    case SECONDS:
        options.seconds = positive_number("seconds", text, "simulated seconds", SECONDS_MAX);
        break;
    case FLASH_CUT:
        options.flash_cut = whole_number("flash-cut", text, 0, UINT32_MAX);
        break;
    case PACE:
        options.pace = positive_number("pace", text, "simulated seconds per second", PACE_MAX);
        break;
    case FOLLOWERS:
        options.followers = static_cast<unsigned>(whole_number("followers", text, 0, LANES));
        break;
    case LANES_POPULATED:
        options.lanes_populated = whole_number("lanes-populated", text, 1, LANES);
        break;
    case SCK_DIVIDER:
        link.sck_divider = static_cast<uint8_t>(
            whole_number("sck-divider", text, WHISKER_LIMIT_SCK_DIVIDER_MIN, WHISKER_LIMIT_SCK_DIVIDER_MAX));
        break;
    case WORD_GAP:
        link.word_gap = static_cast<uint8_t>(whole_number("word-gap", text, WHISKER_LIMIT_WORD_GAP_MIN, UINT8_MAX));
        break;
    default:
        link.sample_point = static_cast<uint8_t>(whole_number("sample-point", text, 1, WHISKER_LIMIT_SCK_DIVIDER_MAX));
        break;
    }
}

Level level_of(const std::string &name)
{
    if (name != "rtl" && name != "bytes") {
        throw std::runtime_error("--level '" + name + "': give rtl or bytes");
    }
    return name == "rtl" ? Level::RTL : Level::BYTES;
}

void set_port(Options &options, Serve serve, const char *text)
{
    if (options.serve != Serve::COMMAND) {
        throw std::runtime_error("--usbip and --usbredir: give one of them, once");
    }
    options.serve = serve;
    options.port =
        static_cast<uint16_t>(whole_number(serve == Serve::USBIP ? "usbip" : "usbredir", text, 0, UINT16_MAX));
}

void set_option(Options &options, int option, const char *text)
{
    if (set_flag(options, option)) {
        return;
    }
    if (option >= CREATE_FIRST) {
        set_create_option(options.create, option, text);
    } else if (std::string *path = path_of(options, option)) {
        *path = text;
    } else if (option == DEFECT) {
        options.defect = Defect::parse(text);
    } else if (option == LEVEL) {
        options.link.level = level_of(text);
    } else if (option == USBIP || option == USBREDIR) {
        set_port(options, option == USBIP ? Serve::USBIP : Serve::USBREDIR, text);
    } else {
        set_number(options, option, text);
    }
}

void require(bool ok, const char *message)
{
    if (!ok) {
        throw std::runtime_error(message);
    }
}

void check(const Options &options)
{
    const bool served = options.serve != Serve::COMMAND;
    require(options.seconds > 0, "--seconds is missing: say how long the run is, for example --seconds 10");
    require(options.link.sample_point <= options.link.sck_divider, "--sample-point is beyond --sck-divider: lower it");
    require(options.usb_faults.empty() || !options.faults.empty(), "--usb-faults needs --faults: give both or neither");
    if (options.bench) {
        require(options.command.empty(), "--bench runs no command: leave out what stands after --");
        require(!served, "--bench has a host of its own: leave out --usbip and --usbredir");
        return;
    }
    require(!options.scene.empty(), "--scene is missing: give a flat scene file, or --bench");
    require(served || !options.command.empty(),
            "the command is missing: give it after --, for example -- whiskerd --ring demo");
    require(!served || options.command.empty(),
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

Options parse_options(int argc, char **argv)
{
    Options options;
    const std::vector<option> all_options = long_options();
    opterr = 0;
    for (;;) {
        const int given = optind;
        const int option = getopt_long(argc, argv, "+:", all_options.data(), nullptr);
        if (option == -1) {
            break;
        }
        if (option == '?' || option == ':') {
            throw std::runtime_error(std::string("'") + argv[given] +
                                     (option == '?' ? "' is no option" : "' needs a value") + "; see --help");
        }
        set_option(options, option, optarg);
    }
    options.command.assign(argv + optind, argv + argc);
    if (!options.help) {
        check(options);
    }
    if (options.bench && options.lanes_populated == 0) {
        options.lanes_populated = BENCH_LANES;
    }
    return options;
}

const char *usage()
{
    return "usage: umockdev-wrapper whisker-bridge-sim --scene FLAT --seconds S [options] -- COMMAND...\n"
           "       whisker-bridge-sim --scene FLAT --seconds S --usbip PORT | --usbredir PORT [options]\n"
           "       whisker-bridge-sim --bench --seconds S [options]\n"
           "\n"
           "Simulates robot, nodes and bridge (RTL) as a USB device that COMMAND, and only it, sees, or a Linux "
           "kernel. No tick is produced\n"
           "before the earlier ones are taken, so the same seed gives the same frames on any machine.\n"
           "\n"
           "  --scene FLAT          flat scene file: arena, robot, start pose\n"
           "  --seconds S           simulated length of the run\n"
           "  --pace X              at most X simulated seconds per second; the world then goes on while nobody takes "
           "frames\n"
           "  --seed N              seed of world, sensors and faults (1)\n"
           "  --socket PATH         where followers and the pilot connect\n"
           "  --followers K         wait for so many of them, the pilot included (0)\n"
           "  --truth OUT.csv       pose and texture tips after every 0.1 s\n"
           "  --wheels OUT.csv      each change of what the Create's wheels are ordered: tick, monotonic clock, "
           "speeds\n"
           "  --faults OUT.csv      inject lane and USB faults; log each spoilt lane,tick,kind\n"
           "  --usb-faults OUT.csv  log each USB fault: tick,kind\n"
           "  --fault-list FILE     inject just these: lines 'lane TICK LANE KIND ARGUMENT', 'usb TICK KIND', ticks "
           "rising\n"
           "  --nodes FILE          single nodes' traits: lines 'LANE serial N', 'LANE chip ID', 'LANE cut BLOCK'\n"
           "  --flash FILE          the configuration flash (1 MiB), made if it is not there; a gateware update "
           "changes it\n"
           "  --flash-cut N         power goes in the midst of the write to it after N; the run ends\n"
           "  --lanes-populated N   nodes on the first N lanes; those without a whisker are at rest (the scene's; "
           "bench: 6)\n"
           "  --speed-report OUT.json  ticks, clock cycles, wall seconds, fault counts\n"
           "  --defect KIND         misbehave: wire-version (claims another), frame (damages one) or truncate (cuts "
           "one)\n"
           "  --level rtl|bytes     the Verilated bridge, cycle by cycle, or its model at the level of transactions: "
           "the "
           "same frames (rtl)\n"
           "  --usbip PORT          serve the device by USB/IP on this port of 127.0.0.1 (0: a free one, which is "
           "printed)\n"
           "  --usbredir PORT       serve it by usbredir, for QEMU's usb-redir\n"
           "  --create 1|2          the base is an iRobot Create behind a serial port; the pilot answers with 'base T "
           "N'\n"
           "  --create-link PATH    where that port, a pseudo-terminal, is linked\n"
           "  --create-NAME ...     whisker-create-sim's options for the robot and its faults, as "
           "--create-drop-remainder\n"
           "  --unplugged           begin without the bridge, until 'plug' comes by the socket\n"
           "  --progress            a line 'progress TICK TICKS' every simulated second (default on a terminal)\n"
           "  --bench               no COMMAND, no umockdev: an internal host reads and checks every frame\n"
           "  --sck-divider N --word-gap N --sample-point N   bench: node link settings, in cycles of 60 MHz (6, 30, "
           "5)\n"
           "  --help                this text\n"
           "\n"
           "Exit code: COMMAND's (0 for a device that was served until a signal came); 1 if the run could not be "
           "completed; 2 for a wrong command line.\n"
           "\n"
           "example: umockdev-wrapper whisker-bridge-sim --scene arena.flat --seconds 10 --seed 7 --faults faults.csv "
           "\\\n"
           "             -- whiskerd --ring demo --sck-divider 6 --word-gap 30 --sample-point 5\n";
}

} // namespace bridge_sim
