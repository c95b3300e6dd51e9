// A ULPI PHY between the levels of UTMI and a link's pins (ULPI 1.1, section 3.8): it says with RXCMDs what the bus
// does, takes the link's commands, and keeps the registers that the link writes. Knows nothing of packets' contents.
#pragma once

#include <cstdint>
#include <deque>

#include "utmi.h"

namespace bridge_sim
{

// How a PHY may differ from a perfect one.
struct PhyTraits {
    uint64_t late = 0;  // cycles after power-up in which dir is high and nothing is said
    unsigned deaf = 0;  // commands at the beginning that get no nxt
    bool quick = false; // a packet begins by dir and nxt together, else by an RXCMD
    // D+ and D- are swapped between PHY and socket until this register holds this value (0: they are not).
    uint8_t swap_register = 0;
    uint8_t swap_value = 0;
};

// What the PHY drives, and what the link does.
struct PhyPins {
    bool dir = true;
    bool nxt = false;
    uint8_t data = 0;
};
struct LinkPins {
    uint8_t data = 0; // 0 unless the link drives it
    bool stp = false;
};

class UlpiPhy
{
  public:
    explicit UlpiPhy(const PhyTraits &traits);

    // The pins during the coming cycle, while the bus is as `in` says.
    PhyPins speak(const UtmiToDevice &in);

    // The edge at its end, at which the link showed this; `out` is what UTMI would show.
    void listen(const LinkPins &link, UtmiFromDevice &out);

    // Cycles from the RXCMD that ended a packet to the command that answers it, if it began at this edge; else 0.
    unsigned answered_after() const;

    // Commands that the PHY cut short by a packet or a status of its own.
    uint64_t aborted() const;

  private:
    struct Said {
        bool byte; // of a packet; else an RXCMD
        uint8_t data;
    };

    void hear_bus(const UtmiToDevice &in);
    void report_status(bool active);
    PhyPins turn_around();
    PhyPins leave_bus(bool tx_ready);
    PhyPins say();
    bool transmitting() const;
    bool swapped() const;
    void begin(uint8_t data);
    void take(uint8_t data);
    void finish();
    void write(uint8_t address, uint8_t value);
    uint8_t transmit_byte(uint8_t data) const;

    PhyTraits traits_;
    std::deque<Said> queue_; // what the bus did and the link has not heard yet
    PhyPins pins_;
    uint64_t busy_;
    uint8_t line_ = 0;
    bool active_ = false;
    bool packet_waits_ = false; // one begins in the queue
    bool in_packet_ = false;    // one is being said
    bool packet_ends_ = false;  // with this RXCMD
    bool answer_due_ = false;
    uint8_t command_ = 0;   // 0: none
    bool answers_ = false;  // the command began at this edge, and answers a packet
    bool accepted_ = false; // the command had its nxt
    uint8_t value_ = 0;     // of a register write
    uint8_t function_control_ = 0;
    uint8_t swap_control_ = 0; // the traits' register
    unsigned quiet_ = 0;       // cycles since the end of the last packet
    uint64_t aborted_ = 0;
};

} // namespace bridge_sim
