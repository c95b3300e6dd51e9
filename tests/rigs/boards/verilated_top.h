// A model of board_bench.v, of whichever board, behind BoardTop.
#pragma once

#include "board_device.h"

namespace bridge_sim
{

template <typename Model> class VerilatedTop : public BoardTop
{
  public:
    BoardOutputs eval(const BoardInputs &in) override
    {
        model_.clk = in.clk;
        model_.rootp->board_bench__DOT__board__DOT__oscillator__DOT__OSC = in.osc;
        model_.dir = in.dir;
        model_.nxt = in.nxt;
        model_.phy_data = in.phy_data;
        model_.miso = in.miso;
        model_.eval();
        return {model_.link_data, model_.link_drives,   model_.stp != 0,  model_.reset != 0, model_.sync != 0,
                model_.sck != 0,  model_.select_n != 0, model_.mosi != 0, model_.led != 0,   model_.leds};
    }

  private:
    Model model_;
};

} // namespace bridge_sim
