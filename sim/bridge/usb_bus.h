// Raw packets on the wire: drives UTMI as PHY and host do, knows line states and timing, nothing of transactions.
#pragma once

#include "usb_packet.h"
#include "utmi.h"

namespace bridge_sim
{

// Quiet time between two packets: more than the 88 bit times a high-speed host keeps (USB 2.0, 7.1.18.2).
constexpr uint64_t PACKET_GAP = 12;
// Time a device needs to see the end of its own packet before the host's handshake.
constexpr uint64_t HANDSHAKE_GAP = 4;

class UsbBus
{
  public:
    explicit UsbBus(UtmiDevice &device);

    // Bus reset and high-speed chirp (USB 2.0, 7.1.7.5). False: the device did not chirp, or not enter high speed.
    bool reset();

    void send(const Bytes &packet);

    // Waits for a packet of the device. False: nothing came in time. A babbler is read to its end, up to twice `limit`.
    bool receive(size_t limit, Bytes &packet);

    // Lets `cycles` pass with the bus idle.
    void idle(uint64_t cycles);

  private:
    bool chirp();
    void hold_line(uint8_t line, uint64_t cycles);
    bool hold_line_until_transmit(uint8_t line, bool level);
    bool wait_for_packet();
    uint8_t idle_line() const;

    UtmiDevice &device_;
    bool high_speed_ = false;
};

} // namespace bridge_sim
