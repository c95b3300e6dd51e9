// The control endpoint of the USB device as a model of its own. It is evaluated only
// in cycles in which something can change: while its registers and its inputs are those of the cycle before, the next
// clock edge would leave them as they are.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

class Vclocked_bridge___024root;
class Vcontrol_endpoint;

namespace bridge_sim
{

class GatedControl
{
  public:
    // `bridge` has its ports where the endpoint was cut out, and must outlive it.
    explicit GatedControl(Vclocked_bridge___024root &bridge);
    ~GatedControl();

    // A clock edge, after that of the bridge, which saw the endpoint's outputs of the cycle before; then as below.
    void edge();

    // What either changes of the other's inputs, until nothing moves.
    void settle();

    // Clock edges that were evaluated.
    uint64_t edges() const;

  private:
    bool inputs_moved();
    bool outputs_moved();
    bool at_rest();

    Vclocked_bridge___024root &bridge_;
    std::unique_ptr<Vcontrol_endpoint> model_;
    std::vector<unsigned char> before_; // the model's state at the last comparison
    bool resting_ = false;              // the next edge changes nothing, unless an input moves
    uint64_t edges_ = 0;
};

} // namespace bridge_sim
