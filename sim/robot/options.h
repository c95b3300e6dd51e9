// The command line of whisker-bridge-sim.
#pragma once

#include <string>
#include <vector>

#include "bench.h"
#include "command_line.h"
#include "defect.h"
extern "C" {
#include "sim_create.h"
}

namespace bridge_sim
{

constexpr char PROGRAM[] = "whisker-bridge-sim";

// The Create: --create and the options of sim/create, each with "create-" before it.
struct CreateOptions {
    bool on = false;
    std::string link; // where the pseudo-terminal is linked
    sim_create_options robot = sim_create_defaults(CREATE_OI_V2);
};

struct Options {
    bool bench = false;
    bool progress = false;
    bool unplugged = false;
    bool usbip = false; // the device is served by USB/IP, else a command under umockdev gets it
    std::string scene;
    std::string socket;
    std::string truth;
    std::string wheels;
    std::string faults;
    std::string usb_faults;
    std::string flash;               // the configuration flash's content
    uint64_t flash_cut = UINT64_MAX; // writes to it until power goes
    std::string nodes;               // traits of single nodes
    std::string fault_list;
    std::string speed_report;
    uint64_t seed = 1;
    double seconds = 0;
    double pace = 0; // simulated seconds per second; 0: as fast as it can
    unsigned followers = 0;
    size_t lanes_populated = 0; // 0: as many as the scene has whiskers
    BenchSettings link;         // SCK divider, word gap and sample point: bench only, else the host software sets them
    DefectKind defect = DefectKind::NONE;
    uint16_t port = 0; // of USB/IP, on 127.0.0.1; 0: any that is free
    CreateOptions create;
    std::vector<std::string> command;

    uint64_t ticks() const;
};

// Reads the command line. Returns COMMAND_LINE_READ, or the exit code: help was printed, or one line that names the
// option and the remedy.
int parse_options(int argc, char **argv, Options &options);

} // namespace bridge_sim
