#include "board_fault.h"

#include <array>
#include <vector>

namespace bridge_sim
{

namespace
{

using Kind = BoardFault::Kind;

constexpr unsigned DATA_LINES = 8;
constexpr std::array<const char *, 13> WIRES = {"DATA",
                                                "DIR",
                                                "NXT",
                                                "STP",
                                                "RESET",
                                                "SYNC",
                                                "SCK",
                                                "SELECT",
                                                "MOSI",
                                                "MISO",
                                                "CLOCK",
                                                "DRIVE",
                                                "polarity register"};
constexpr std::array<const char *, 5> KINDS = {"right", "swapped", "inverted", "stuck low", "stuck high"};

struct Choice {
    Kind kind;
    Wire wire;
    Wire other;
};

// Pins that a slip exchanges: of the same direction. A clock has one way to be wrong, and so has the register.
std::vector<Choice> choices(bool polarity)
{
    std::vector<Choice> all = {{Kind::SWAPPED, Wire::DATA, Wire::DATA},    {Kind::SWAPPED, Wire::MISO, Wire::MISO},
                               {Kind::SWAPPED, Wire::DIR, Wire::NXT},      {Kind::SWAPPED, Wire::SYNC, Wire::SCK},
                               {Kind::SWAPPED, Wire::SYNC, Wire::SELECT},  {Kind::SWAPPED, Wire::SYNC, Wire::MOSI},
                               {Kind::SWAPPED, Wire::SCK, Wire::SELECT},   {Kind::SWAPPED, Wire::SCK, Wire::MOSI},
                               {Kind::SWAPPED, Wire::SELECT, Wire::MOSI},  {Kind::SWAPPED, Wire::STP, Wire::RESET},
                               {Kind::LOW, Wire::CLOCK, Wire::CLOCK},      {Kind::INVERTED, Wire::DRIVE, Wire::DRIVE},
                               {Kind::LOW, Wire::DRIVE, Wire::DRIVE},      {Kind::HIGH, Wire::DRIVE, Wire::DRIVE},
                               {Kind::INVERTED, Wire::RESET, Wire::RESET}, {Kind::HIGH, Wire::RESET, Wire::RESET}};
    for (const Wire wire :
         {Wire::DATA, Wire::DIR, Wire::NXT, Wire::STP, Wire::SYNC, Wire::SCK, Wire::SELECT, Wire::MOSI, Wire::MISO}) {
        for (const Kind kind : {Kind::INVERTED, Kind::LOW, Kind::HIGH}) {
            all.push_back({kind, wire, wire});
        }
    }
    if (polarity) {
        all.push_back({Kind::INVERTED, Wire::POLARITY, Wire::POLARITY});
    }
    return all;
}

unsigned below(std::mt19937_64 &generator, unsigned limit)
{
    return static_cast<unsigned>(generator() % limit);
}

} // namespace

std::string BoardFault::name() const
{
    std::string text = WIRES.at(static_cast<size_t>(wire));
    const bool lines = wire == Wire::DATA || wire == Wire::MISO;
    text += lines ? " " + std::to_string(a) : "";
    if (kind == Kind::SWAPPED) {
        text += " and " + (lines ? std::to_string(b) : std::string(WIRES.at(static_cast<size_t>(other))));
    }
    return text + " " + KINDS.at(static_cast<size_t>(kind));
}

BoardFault BoardFault::draw(std::mt19937_64 &generator, unsigned lanes, bool polarity)
{
    const std::vector<Choice> all = choices(polarity);
    const Choice choice = all[below(generator, static_cast<unsigned>(all.size()))];
    const unsigned lines = choice.wire == Wire::MISO ? lanes : DATA_LINES;
    const unsigned a = below(generator, lines);
    const unsigned b = (a + 1 + below(generator, lines - 1)) % lines;
    return {choice.kind, choice.wire, choice.other, a, b};
}

} // namespace bridge_sim
