// A board: its Verilated top between a ULPI PHY and nodes, with one fault at most. The USB host talks to the PHY's
// other side. The PHY's clock stands still while the PHY is in reset, or when it hangs; the FPGA's own oscillator runs
// on.
#pragma once

#include <memory>

#include "board.h"
#include "board_fault.h"
#include "node_bus.h"
#include "ulpi_phy.h"

namespace bridge_sim
{

// What of a board the bench must know beside its top.
struct BoardTraits {
    PhyTraits phy;
    bool phy_gives_clock; // else it takes the FPGA's, from an oscillator
};

// The pins of board_bench.v, of whichever board, and the FPGA's own oscillator.
struct BoardInputs {
    bool clk = false, osc = false, dir = true, nxt = false;
    uint8_t phy_data = 0;
    uint32_t miso = 0;
};
struct BoardOutputs {
    uint8_t link_data = 0, link_drives = 0;
    bool stp = false, reset = false, sync = false, sck = false, select_n = true, mosi = false, led = false;
    uint8_t leds = 0;
};

// The Verilated top behind one interface.
class BoardTop
{
  public:
    virtual ~BoardTop() = default;
    virtual BoardOutputs eval(const BoardInputs &in) = 0;
};
std::unique_ptr<BoardTop> make_usb3300_board();
std::unique_ptr<BoardTop> make_cynthion();
std::unique_ptr<BoardTop> make_tang();

class BoardDevice : public Board
{
  public:
    // After configuration of the FPGA. The nodes must outlive the board.
    BoardDevice(std::unique_ptr<BoardTop> top, const BoardTraits &traits, NodeBus &nodes, const BoardFault &fault = {});
    ~BoardDevice() override;

    // Throws std::runtime_error when FPGA and PHY drive the bus at once, or some pads let go and others do not.
    void cycle() override;

    // The PHY's clock stops until the PHY is reset.
    void hang();

    uint8_t leds() const override;
    bool led() const;        // of a board that has one
    uint64_t resets() const; // of the PHY: times its reset pin became active
    bool bus_is_idle() const override;

  private:
    using Levels = std::array<bool, 16>; // by Wire
    static size_t at(Wire wire);
    void spoil(Levels &levels) const;
    uint32_t spoil(Wire wire, uint32_t lines) const;
    void take(const BoardOutputs &outputs, bool dir);
    void step_oscillator();
    bool clocked() const;

    std::unique_ptr<BoardTop> top_;
    BoardTraits traits_;
    NodeBus &nodes_;
    BoardFault fault_;
    UlpiPhy phy_;
    BoardInputs inputs_;
    Levels levels_{}; // of the board's outputs, as PHY and nodes see them
    BoardOutputs outputs_;
    bool hangs_ = false;
    bool busy_ = false; // select is low
    uint64_t resets_ = 0;
};

} // namespace bridge_sim
