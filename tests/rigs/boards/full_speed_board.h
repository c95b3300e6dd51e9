// A board whose PHY is gateware: its Verilated top between a full-speed cable and nodes. The host's bytes take their
// time on the cable: a call of cycle() that moves a byte lasts as long as the byte.
#pragma once

#include <memory>

#include "board.h"
#include "board_fault.h"
#include "full_speed_wire.h"
#include "node_bus.h"

class Vulx3s_bench;

namespace bridge_sim
{

class FullSpeedBoard : public Board
{
  public:
    // After configuration of the FPGA; `swapped`: D+ and D- are exchanged. The nodes must outlive the board.
    FullSpeedBoard(NodeBus &nodes, bool swapped);
    ~FullSpeedBoard() override;

    // Throws std::runtime_error when host and device drive the cable at once.
    void cycle() override;
    uint8_t leds() const override;
    bool bus_is_idle() const override;

  private:
    LinePair step(bool p, bool n);
    void edges();
    void send();
    void idle();
    void receive();

    NodeBus &nodes_;
    bool swapped_;
    std::unique_ptr<Vulx3s_bench> top_;
    FullSpeedWire wire_;
    uint64_t units_ = 0;     // of 240 MHz
    bool sending_ = false;   // the host
    bool receiving_ = false; // the host
    uint8_t byte_ = 0;       // of the device, decoded and not taken yet
    bool busy_ = false;      // select is low
};

} // namespace bridge_sim
