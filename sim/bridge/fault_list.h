// Faults given one by one in a file, instead of drawn from the seed.
#pragma once

#include <string>
#include <vector>

#include "fault_plan.h"

namespace bridge_sim
{

// Ticks rise, at most one fault of each kind of list per tick.
struct FaultList {
    std::vector<LaneFault> lane;
    std::vector<UsbFault> usb;
    std::vector<LastingFault> lasting; // in no order
};

// A line per fault, ticks rising: "lane TICK LANE KIND ARGUMENT" (argument: the bit of a flip, the sensor's error word,
// else 0) or "usb TICK KIND"; and "lasting TICK UNTIL LANE KIND", in no order. lanes: populated ones. Throws
// std::runtime_error: file, line, what, remedy.
FaultList read_fault_list(const std::string &path, size_t lanes);

} // namespace bridge_sim
