#include "board_device.h"

#include <stdexcept>
#include <utility>

namespace bridge_sim
{

namespace
{

constexpr uint64_t OSCILLATOR_HALF = 12; // cycles of 60 MHz: 2.4 MHz, nearly
constexpr uint64_t PHY_START = 6000;     // cycles from the end of reset to the first sign of life
constexpr uint32_t ALL_LANES = UINT32_MAX >> (32 - LANES);

} // namespace

// The board's register value is what its top writes: another one leaves the lines swapped.
static PhyTraits board_device_with_fault(PhyTraits phy, const BoardFault &fault)
{
    phy.swap_value ^= fault.wire == Wire::POLARITY && fault.kind == BoardFault::Kind::INVERTED ? 2u : 0u;
    return phy;
}

BoardDevice::BoardDevice(std::unique_ptr<BoardTop> top, const BoardTraits &traits, NodeBus &nodes,
                         const BoardFault &fault)
    : top_(std::move(top)), traits_(traits), nodes_(nodes), fault_(fault),
      phy_(board_device_with_fault(traits.phy, fault))
{
    inputs_.miso = ALL_LANES;
    levels_[at(Wire::SELECT)] = true;
}

BoardDevice::~BoardDevice() = default;

size_t BoardDevice::at(Wire wire)
{
    return static_cast<size_t>(wire);
}

void BoardDevice::hang()
{
    hangs_ = true;
}

uint8_t BoardDevice::leds() const
{
    return outputs_.leds;
}

bool BoardDevice::led() const
{
    return outputs_.led;
}

uint64_t BoardDevice::resets() const
{
    return resets_;
}

bool BoardDevice::bus_is_idle() const
{
    return !levels_[at(Wire::SYNC)] && !levels_[at(Wire::SCK)] && levels_[at(Wire::SELECT)];
}

void BoardDevice::spoil(Levels &levels) const
{
    bool &level = levels[at(fault_.wire)];
    switch (fault_.kind) {
    case BoardFault::Kind::NONE:
        break;
    case BoardFault::Kind::SWAPPED:
        std::swap(level, levels[at(fault_.other)]);
        break;
    case BoardFault::Kind::INVERTED:
        level = !level;
        break;
    default:
        level = fault_.kind == BoardFault::Kind::HIGH;
    }
}

uint32_t BoardDevice::spoil(Wire wire, uint32_t lines) const
{
    if (fault_.wire != wire) {
        return lines;
    }
    const uint32_t a = 1u << fault_.a, b = 1u << fault_.b;
    switch (fault_.kind) {
    case BoardFault::Kind::NONE:
        return lines;
    case BoardFault::Kind::SWAPPED:
        return (lines & ~(a | b)) | (lines & a ? b : 0) | (lines & b ? a : 0);
    case BoardFault::Kind::INVERTED:
        return lines ^ a;
    default:
        return fault_.kind == BoardFault::Kind::HIGH ? lines | a : lines & ~a;
    }
}

bool BoardDevice::clocked() const
{
    const bool dead = fault_.wire == Wire::CLOCK && fault_.kind != BoardFault::Kind::NONE;
    return !dead && !(traits_.phy_gives_clock && (hangs_ || levels_[at(Wire::RESET)]));
}

void BoardDevice::step_oscillator()
{
    if (cycles % OSCILLATOR_HALF == 0) {
        inputs_.osc = !inputs_.osc;
    }
}

void BoardDevice::take(const BoardOutputs &outputs, bool dir)
{
    const bool was_reset = levels_[at(Wire::RESET)];
    Levels levels{};
    levels[at(Wire::STP)] = outputs.stp;
    levels[at(Wire::RESET)] = outputs.reset;
    levels[at(Wire::SYNC)] = outputs.sync;
    levels[at(Wire::SCK)] = outputs.sck;
    levels[at(Wire::SELECT)] = outputs.select_n;
    levels[at(Wire::MOSI)] = outputs.mosi;
    levels[at(Wire::DRIVE)] = outputs.link_drives != 0;
    spoil(levels);
    levels_ = levels;
    if (outputs.link_drives != 0 && outputs.link_drives != UINT8_MAX) {
        throw std::runtime_error("some pads drive and others do not");
    }
    if (levels_[at(Wire::DRIVE)] && dir) {
        throw std::runtime_error("FPGA and PHY drive the bus at once");
    }
    if (levels_[at(Wire::RESET)] && !was_reset) {
        resets_++;
        hangs_ = false;
        PhyTraits anew = board_device_with_fault(traits_.phy, fault_);
        anew.late = PHY_START;
        phy_ = UlpiPhy(anew);
    }
    outputs_ = outputs;
}

// Inputs settle with the clock low, outputs are read as they stand at the rising edge, then the edge comes. A PHY in
// reset says nothing and has no clock.
void BoardDevice::cycle()
{
    const bool runs = !levels_[at(Wire::RESET)] && !hangs_;
    const PhyPins pins = runs ? phy_.speak(in) : PhyPins{};
    Levels levels{};
    levels[at(Wire::DIR)] = pins.dir;
    levels[at(Wire::NXT)] = pins.nxt;
    spoil(levels);
    inputs_.dir = levels[at(Wire::DIR)];
    inputs_.nxt = levels[at(Wire::NXT)];
    inputs_.phy_data = static_cast<uint8_t>(spoil(Wire::DATA, pins.data));
    inputs_.clk = false;
    step_oscillator();
    const BoardOutputs outputs = top_->eval(inputs_);
    take(outputs, pins.dir);
    if (runs) {
        const uint32_t link = levels_[at(Wire::DRIVE)] ? spoil(Wire::DATA, outputs.link_data) : 0;
        phy_.listen({static_cast<uint8_t>(link), levels_[at(Wire::STP)]}, out);
    }
    const uint32_t miso = nodes_.pins(levels_[at(Wire::SYNC)], levels_[at(Wire::SELECT)], levels_[at(Wire::SCK)],
                                      levels_[at(Wire::MOSI)]);
    inputs_.miso = spoil(Wire::MISO, miso) & ALL_LANES;
    const bool busy = !levels_[at(Wire::SELECT)];
    if (busy_ && !busy) {
        nodes_.run();
    }
    busy_ = busy;
    if (clocked()) {
        inputs_.clk = true;
        top_->eval(inputs_);
    }
    cycles++;
}

} // namespace bridge_sim
