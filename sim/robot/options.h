// The command line of whisker-bridge-sim.
#pragma once

#include <string>
#include <vector>

#include "bench.h"
#include "create_options.h"
#include "defect.h"

namespace bridge_sim
{

// Who gets the device: a command under umockdev, or the client that connects to a port.
enum class Serve { COMMAND, USBIP, USBREDIR };

struct Options {
    bool help = false;
    bool bench = false;
    bool progress = false;
    bool unplugged = false;
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
    Serve serve = Serve::COMMAND;
    uint16_t port = 0; // of 127.0.0.1; 0: any that is free
    CreateOptions create;
    std::vector<std::string> command;

    uint64_t ticks() const;
};

// Throws std::runtime_error with one line that names the option and the remedy.
Options parse_options(int argc, char **argv);

const char *usage();

} // namespace bridge_sim
