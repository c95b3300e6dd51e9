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

enum class BusSpeed { HIGH, FULL };

class UsbBus
{
  public:
    explicit UsbBus(UtmiDevice &device);

    // Bus reset and high-speed chirp (USB 2.0, 7.1.7.5), which a hub of full speed does not answer. False: the device
    // did not chirp, or is not at the hub's speed afterwards.
    bool reset(BusSpeed speed);

    void send(const Bytes &packet);

    // Lets the bus idle until the device must have gone to sleep (7.1.7.6). False: it has not its full-speed pull-up
    // on.
    bool suspend();

    // Drives K for `cycles` (a real host: 20 ms), then the end of resume (7.1.7.7). False: the device left full speed
    // before its end, or is not at its former speed soon after it.
    bool resume(uint64_t cycles);

    // Waits for a packet of the device. False: nothing came in time. A babbler is read to its end, up to twice `limit`.
    bool receive(size_t limit, Bytes &packet);

    // Lets `cycles` pass with the bus idle.
    void idle(uint64_t cycles);

    // Did the device speak while the bus was idle, since the last call?
    bool take_unasked();

  private:
    bool chirp(BusSpeed speed);
    bool at_speed(bool high) const;
    void hold_line(uint8_t line, uint64_t cycles);
    bool hold_line_until_transmit(uint8_t line, bool level);
    bool wait_for_packet();
    uint8_t idle_line() const;

    UtmiDevice &device_;
    bool high_speed_ = false;
    bool unasked_ = false;
};

} // namespace bridge_sim
