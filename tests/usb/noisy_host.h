// A USB host among noise: random packets that are not for the device or not whole, other devices' traffic, and the
// regular transactions of UsbHost in between. The device must not answer any of the noise, nor lose anything by it.
#pragma once

#include <random>

#include "usb_host.h"

namespace bridge_sim
{

enum class Noise {
    JUNK,         // random bytes
    FRAGMENT,     // the beginning of a token or of a data packet for the device
    BAD_CRC_DATA, // an OUT's data with a wrong CRC-16
    LONE_DATA,    // data that no token announced
    BABBLE,       // a packet far too long
    OTHERS_IN,    // token, data and ACK between host and another device
    LONE_ACK,     // an ACK of another device's, whose token the device did not hear
    SETUP_ASTRAY, // a SETUP to an endpoint that takes none
    KINDS
};

class NoisyHost
{
  public:
    NoisyHost(UsbHost &host, uint64_t seed);

    // Puts one packet or transaction of noise on the wire. Returns false if the device answered it.
    bool make(Noise noise);
    Noise draw();

    // A number below `bound`.
    uint64_t below(uint64_t bound);

  private:
    Bytes random_bytes(size_t count);
    Bytes token(Pid pid, uint8_t address, uint8_t endpoint) const;
    void send(const Bytes &packet);
    bool silent();

    UsbHost &host_;
    std::mt19937_64 generator_;
};

} // namespace bridge_sim
