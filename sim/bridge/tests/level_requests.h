// Control transfers drawn at random: reports within their limits, reads of reports, and whatever a host may ask.
#pragma once

#include <random>

#include "level_pair.h"

namespace bridge_sim
{

constexpr uint8_t SET_REPORT_TYPE = 0x21;      // bmRequestType
constexpr uint16_t FEATURE_REPORT = 0x03 << 8; // in wValue, above the report's id

class RequestSource
{
  public:
    explicit RequestSource(uint64_t seed);

    uint64_t below(uint64_t bound);
    bool chance(uint64_t one_in);

    // Settings that are accepted, most often fast ones.
    HostRequest control(bool run);

    // A service order; most often one that nodes answer and do not act on.
    HostRequest service();

    // An order to the configuration flash, most often one that is accepted while no run is in progress.
    HostRequest flash();

    // A read of a report, there or not, of any length.
    HostRequest get();

    // Anything, most often a descriptor.
    HostRequest any();

  private:
    std::mt19937_64 random_;
};

} // namespace bridge_sim
