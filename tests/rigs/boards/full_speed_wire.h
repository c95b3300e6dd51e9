// The D+ and D- of a full-speed cable: packets as levels, five cycles of 60 MHz a bit, NRZI and bit stuffing (USB 2.0,
// 7.1.8, 7.1.9).
#pragma once

#include <cstdint>
#include <functional>

namespace bridge_sim
{

struct LinePair {
    bool p = true, n = false; // J
    bool driven = false;      // by the device
};

class FullSpeedWire
{
  public:
    // step: one cycle of 60 MHz with these levels from the host; what is on the wire then.
    explicit FullSpeedWire(std::function<LinePair(bool p, bool n)> step);

    // What the host drives for one cycle. True: the device has begun to drive.
    bool hold(bool p, bool n);

    // The host's packet, piece by piece.
    void send_sync();
    void send(uint8_t byte);
    void send_end();

    // After the device has begun: its SYNC, then its bytes. False: its packet has ended.
    bool receive_sync();
    bool receive(uint8_t &byte);

  private:
    void send_bit(bool one);
    void drive(bool p, bool n);
    bool receive_bit(bool &one);

    std::function<LinePair(bool, bool)> step_;
    bool level_ = true; // J
    unsigned ones_ = 0;
};

} // namespace bridge_sim
