// The whole bridge with a tick asked for every so many cycles, whatever the USB host does meanwhile: how fast can it
// go? Nodes keep up with any period, for they read their sensors in virtual time of their own.
#pragma once

#include "bridge_model.h"
#include "usb_host.h"

namespace bridge_sim
{

class PacedBridge : public UtmiDevice
{
  public:
    // Nodes on all lanes, seeded; no ticks are asked for yet.
    explicit PacedBridge(uint64_t seed);

    void cycle() override;

    // From the next cycle on a tick every `period` cycles (at least 1), until `ticks` were asked for.
    void pace(uint64_t period, uint64_t ticks);

    bool all_asked() const;
    bool running() const;

  private:
    NodeBus nodes_;
    NorFlash flash_;
    BridgeModel bridge_;
    uint64_t period_ = 1;
    uint64_t left_ = 0;  // ticks to ask for
    uint64_t wait_ = 0;  // cycles until the next
    bool busy_ = false;  // the link was, a cycle ago
    bool ended_ = false; // a transfer has: the nodes see select rise now
};

struct PaceResult {
    uint64_t asked = 0;  // ticks
    uint64_t frames = 0; // each whole, in order and the next of the one before
    uint64_t bad = 0;    // records of settled nodes that were not good
    uint64_t naks = 0;   // IN tokens for which there was nothing
    uint64_t cycles = 0;

    bool sustained() const;
};

// A run of `ticks` ticks at the fastest settings of the bus, read by a host that rests `rest` cycles after each
// transaction. Throws std::runtime_error with one line if a frame is missing among those read.
PaceResult run_paced(uint64_t period, uint64_t ticks, uint64_t rest);

} // namespace bridge_sim
