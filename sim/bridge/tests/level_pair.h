// The bridge at both levels, driven alike: every answer of one is compared with the other's, byte by byte.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>

#include "rig.h"

namespace bridge_sim
{

// A control transfer that a host makes.
struct HostRequest {
    SetupRequest setup;
    Bytes data;
};

class LevelPair
{
  public:
    // Nodes on the first lanes; the device is enumerated.
    LevelPair(size_t populated, uint64_t seed);

    // Each throws std::runtime_error that names the first difference.
    Outcome control(const HostRequest &request);
    // A control transfer, and the end of the order to the flash that it gave; the report says what came of it.
    Outcome flash(const HostRequest &request);
    Outcome read_packet();
    Outcome in(uint8_t endpoint);
    void tick(const sim_field *fields, const std::optional<HostRequest> &meanwhile);
    void bus_reset(bool within_tick, const sim_field *fields);
    void power_cycle();
    void spoil(const LaneFault &fault);
    void arm(WireFault fault);

    bool running() const;

    // What there was to compare, for a test of the test.
    uint64_t packets = 0, empty_packets = 0, stalls = 0;

  private:
    template <typename Action> void both(const char *what, uint64_t rest, Action action);
    void compare(const std::string &what);

    std::unique_ptr<Rig> rigs_[2];
    std::string answers_[2]; // to the step in progress
};

} // namespace bridge_sim
