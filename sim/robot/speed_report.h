// How fast a run went and what was injected into it, as JSON.
#pragma once

#include <string>
#include <vector>

#include "fault_log.h"

namespace bridge_sim
{

struct Speed {
    uint64_t ticks = 0;
    uint64_t cycles = 0; // of the 60 MHz clock that were simulated
    double wall_s = 0;
    size_t lanes_populated = 0;
    std::vector<uint64_t> rtl_ticks; // of each simulated second, those that the Verilated bridge made

    double simulated_s() const;
    double realtime_factor() const; // simulated seconds per wall second
    double cycles_per_tick() const;
};

// Writes the report; nothing if the path is empty. Throws std::runtime_error if it cannot be written.
void write_speed_report(const std::string &path, const Speed &speed, const FaultLog &faults);

} // namespace bridge_sim
