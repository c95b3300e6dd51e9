// A fault of a board: a slip in its pin file or in its top, made where its pins meet PHY and nodes.
#pragma once

#include <cstdint>
#include <random>
#include <string>

namespace bridge_sim
{

// The wires between FPGA, PHY and nodes, and what may be wrong with one.
enum class Wire : uint8_t { DATA, DIR, NXT, STP, RESET, SYNC, SCK, SELECT, MOSI, MISO, CLOCK, DRIVE, POLARITY };

struct BoardFault {
    enum class Kind : uint8_t {
        NONE,
        SWAPPED,  // with the wire `other`, or line `a` with line `b` of DATA or MISO
        INVERTED, // line `a` of DATA or MISO, or the whole wire
        LOW,      // stuck
        HIGH
    };
    Kind kind = Kind::NONE;
    Wire wire = Wire::DATA;
    Wire other = Wire::DATA;
    unsigned a = 0;
    unsigned b = 0;

    std::string name() const;

    // One that a board can have, by its number of lanes and whether its PHY needs a polarity register.
    static BoardFault draw(std::mt19937_64 &generator, unsigned lanes, bool polarity);
};

} // namespace bridge_sim
