// The Verilated bridge with its nodes on the bus: one cycle() steps the RTL, the node wires and nothing else.
#pragma once

#include <memory>

#include "flash/nor_flash.h"
#include "node_bus.h"
#include "sampling_state.h"
#include "utmi.h"

class Vclocked_bridge;

namespace bridge_sim
{

class BridgeModel : public UtmiDevice
{
  public:
    // The bridge after power-on reset, its ticks taken from start_tick(). Bus and flash must outlive the model.
    BridgeModel(NodeBus &bus, NorFlash &flash);
    ~BridgeModel() override;

    void cycle() override;

    // From now on ticks are the bridge's own, every tick_period, as on a board; else they are start_tick()'s.
    void tick_by_itself();

    // From now on the nodes read their sensors after each tick; else the caller runs them.
    void run_nodes_by_itself();

    // As after power came: registers, FIFO and USB device begin anew.
    void reset();

    // Begins a tick: one cycle of the external tick strobe. The link is busy after the next cycle.
    void start_tick();

    // As they are in the cycle that begins.
    bool sync() const;               // the pin
    unsigned pins() const;           // to nodes and flash: sync, select_n, sck, mosi, flash_cs_n, _sck, _mosi as bits
    bool link_busy() const;          // SYNC and transfer on the node link in progress
    bool running() const;            // from start until the last frame is in the FIFO
    uint32_t frames_dropped() const; // since start
    bool every_frame() const;        // each frame ends its packet
    uint32_t tick_period() const;    // cycles

    // In a model of bytes a run of plain sampling may go on from here, between two ticks with no frame in the bridge;
    // it comes back as far as it has come, at such a time.
    SamplingSettings settings() const;
    SamplingState sampling() const;
    void go_on(const SamplingState &state);

  private:
    void run_nodes();

    NodeBus &bus_;
    FlashPins flash_;
    std::unique_ptr<Vclocked_bridge> top_;
    bool runs_nodes_ = false;
    bool busy_ = false;  // the link was, a cycle ago
    bool ended_ = false; // its transfer has
};

} // namespace bridge_sim
