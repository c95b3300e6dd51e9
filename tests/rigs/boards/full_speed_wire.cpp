#include "full_speed_wire.h"

#include <utility>

namespace bridge_sim
{

namespace
{

constexpr int BIT = 5, HALF = 2; // cycles
constexpr uint8_t SYNC = 0x80;
constexpr unsigned STUFF_AFTER = 6;

} // namespace

FullSpeedWire::FullSpeedWire(std::function<LinePair(bool, bool)> step) : step_(std::move(step))
{
}

bool FullSpeedWire::hold(bool p, bool n)
{
    return step_(p, n).driven;
}

void FullSpeedWire::drive(bool p, bool n)
{
    for (int i = 0; i < BIT; i++) {
        step_(p, n);
    }
}

void FullSpeedWire::send_bit(bool one)
{
    level_ = one ? level_ : !level_;
    drive(level_, !level_);
    ones_ = one ? ones_ + 1 : 0;
    if (ones_ == STUFF_AFTER) {
        send_bit(false);
    }
}

void FullSpeedWire::send_sync()
{
    level_ = true;
    ones_ = 0;
    send(SYNC);
}

void FullSpeedWire::send(uint8_t byte)
{
    for (int bit = 0; bit < 8; bit++) {
        send_bit(byte >> bit & 1);
    }
}

void FullSpeedWire::send_end()
{
    drive(false, false);
    drive(false, false);
    drive(true, false);
}

// One bit, sampled in its middle: the device's clock is the bench's. SE0 ends the packet.
bool FullSpeedWire::receive_bit(bool &one)
{
    LinePair middle;
    for (int i = 0; i < BIT; i++) {
        const LinePair now = step_(true, false);
        middle = i == HALF ? now : middle;
    }
    if (!middle.driven || (!middle.p && !middle.n)) {
        return false;
    }
    one = middle.p == level_;
    level_ = middle.p;
    ones_ = one ? ones_ + 1 : 0;
    return true;
}

bool FullSpeedWire::receive_sync()
{
    level_ = true;
    ones_ = 0;
    uint8_t byte = 0;
    for (int i = 0; i < 2 * BIT && step_(true, false).p; i++) { // J until the first K
    }
    bool one = true;
    for (int bit = 0; bit < 8 && receive_bit(one); bit++) {
        byte = static_cast<uint8_t>(byte >> 1 | (one ? 0x80 : 0));
    }
    return byte == SYNC;
}

bool FullSpeedWire::receive(uint8_t &byte)
{
    for (int bit = 0; bit < 8;) {
        const bool stuffed = ones_ == STUFF_AFTER;
        bool one = false;
        if (!receive_bit(one)) {
            return false;
        }
        if (stuffed) {
            ones_ = 0;
            continue;
        }
        byte = static_cast<uint8_t>(byte >> 1 | (one ? 0x80 : 0));
        bit++;
    }
    return true;
}

} // namespace bridge_sim
