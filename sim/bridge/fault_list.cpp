#include "fault_list.h"

#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr int KIND_BYTES = 32;

template <typename Kind> std::string kinds_of(unsigned count)
{
    std::string names;
    for (unsigned i = 0; i < count; i++) {
        names += (i ? ", " : "") + std::string(fault_name(static_cast<Kind>(i)));
    }
    return names;
}

template <typename Kind> Kind kind_of(const char *name, unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        if (fault_name(static_cast<Kind>(i)) == std::string(name)) {
            return static_cast<Kind>(i);
        }
    }
    throw std::runtime_error("'" + std::string(name) + "' is no such fault; use one of " + kinds_of<Kind>(count));
}

template <typename Fault> void append(std::vector<Fault> &faults, const Fault &fault)
{
    if (!faults.empty() && fault.tick <= faults.back().tick) {
        throw std::runtime_error("tick " + std::to_string(fault.tick) + " after tick " +
                                 std::to_string(faults.back().tick) + "; give one fault per tick, ticks rising");
    }
    faults.push_back(fault);
}

void require_populated(size_t lane, size_t lanes)
{
    if (lane >= lanes) {
        throw std::runtime_error("lane " + std::to_string(lane) + " is not populated; give 0 to " +
                                 std::to_string(lanes - 1));
    }
}

void read_line(const std::string &line, size_t lanes, FaultList &list)
{
    char kind[KIND_BYTES] = "";
    uint64_t tick = 0;
    uint64_t until = 0;
    size_t lane = 0;
    unsigned argument = 0;
    if (std::sscanf(line.c_str(), "lane %" SCNu64 " %zu %31s %u", &tick, &lane, kind, &argument) == 4) {
        require_populated(lane, lanes);
        append(list.lane, LaneFault{tick, lane, kind_of<LaneFaultKind>(kind, LANE_FAULT_KINDS), argument});
    } else if (std::sscanf(line.c_str(), "usb %" SCNu64 " %31s", &tick, kind) == 2) {
        append(list.usb, UsbFault{tick, kind_of<UsbFaultKind>(kind, USB_FAULT_KINDS)});
    } else if (std::sscanf(line.c_str(), "lasting %" SCNu64 " %" SCNu64 " %zu %31s", &tick, &until, &lane, kind) == 4) {
        require_populated(lane, lanes);
        list.lasting.push_back({tick, until, lane, kind_of<LastingKind>(kind, LASTING_KINDS)});
    } else {
        throw std::runtime_error(
            "'" + line + "'; give 'lane TICK LANE KIND ARGUMENT', 'usb TICK KIND' or 'lasting TICK UNTIL LANE KIND'");
    }
}

} // namespace

FaultList read_fault_list(const std::string &path, size_t lanes)
{
    std::ifstream file(path);
    if (!file) {
        throw std::runtime_error(path + ": cannot be read; give a file of faults");
    }
    FaultList list;
    std::string line;
    for (unsigned number = 1; std::getline(file, line); number++) {
        try {
            read_line(line, lanes, list);
        } catch (const std::runtime_error &error) {
            throw std::runtime_error(path + ", line " + std::to_string(number) + ": " + error.what());
        }
    }
    return list;
}

} // namespace bridge_sim
