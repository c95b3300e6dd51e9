// Transactions of a USB 2.0 high-speed host: tokens, data toggles, handshakes, time-outs, retries and deliberate
// faults. Every irregular answer is returned and counted.
#pragma once

#include <array>
#include <cstdint>

#include "usb_bus.h"

namespace bridge_sim
{

// How one transaction ended. TIMEOUT .. BABBLE are what is left after the retries a host controller makes.
enum class Outcome { OK, NAK, STALL, TIMEOUT, CRC, PID, BABBLE };

// Deliberate faults on the wire; each is used up by the next transaction it fits.
enum class WireFault {
    NONE,
    LOST_ACK,  // the host's ACK of an IN is lost: the device must repeat, the host drops the copy by its toggle
    BAD_TOKEN, // an IN token with a wrong CRC-5: the device must stay silent
    BAD_DATA,  // an IN's data reaches the host with a flipped bit: the host stays silent, the device must repeat
    BAD_SETUP  // a SETUP's data reaches the device with a wrong CRC-16: it must stay silent
};

struct HostCounters {
    uint64_t transactions = 0;
    uint64_t naks = 0;
    uint64_t stalls = 0;
    uint64_t timeouts = 0;    // no answer where one was due
    uint64_t crc_errors = 0;  // data whose CRC-16 is wrong
    uint64_t pid_errors = 0;  // unknown or misplaced packet identifiers
    uint64_t babbles = 0;     // packets longer than the endpoint allows
    uint64_t duplicates = 0;  // data dropped because of its toggle
    uint64_t violations = 0;  // answers to a packet the device had to ignore
    uint64_t injected = 0;    // deliberate faults carried out
    uint64_t unexplained = 0; // irregularities that no deliberate fault explains
};

class UsbHost
{
  public:
    explicit UsbHost(UtmiDevice &device);

    // Bus reset with chirp, address 0, all toggles DATA0. False: the device is not at this speed.
    bool reset(BusSpeed speed = BusSpeed::HIGH);

    // The wire itself, for packets that no host would send.
    UsbBus &bus();
    uint8_t address() const;

    // Start-of-frame token; the caller decides when one is due.
    void start_of_frame();

    // How many of them there were, modulo 65536; a host that goes on after another one takes its number over.
    uint16_t microframe() const;
    void set_microframe(uint64_t microframe);

    // IN transaction. On OK `data` holds the payload (which may be empty). `limit`: the endpoint's packet size.
    Outcome in(uint8_t endpoint, size_t limit, Bytes &data);

    // OUT transaction of at most one packet.
    Outcome out(uint8_t endpoint, const uint8_t *data, size_t count);

    // SETUP transaction: always DATA0 to endpoint 0; leaves both toggles of endpoint 0 at DATA1.
    Outcome setup(const uint8_t request[8]);

    // Toggle rules that follow from control requests: SET_ADDRESS, SET_CONFIGURATION, CLEAR_FEATURE(HALT).
    void set_address(uint8_t address);
    void clear_toggles();
    void clear_toggle(uint8_t endpoint, bool in);
    void set_toggle(uint8_t endpoint, bool in, bool value);

    // Lets the next fitting transaction suffer this fault.
    void arm(WireFault fault);
    WireFault armed() const;

    // Lets `cycles` pass with the bus idle.
    void idle(uint64_t cycles);

    const HostCounters &counters() const;

  private:
    void send_token(Pid pid, uint8_t endpoint, bool spoil);
    void spoiled_token(uint8_t endpoint);
    void spoiled_setup(const Bytes &packet);
    void expect_silence();
    void violation();
    Outcome in_once(uint8_t endpoint, size_t limit, Bytes &data, bool &duplicate);
    Outcome take_data(uint8_t endpoint, Bytes &data, bool &duplicate);
    void acknowledge(uint8_t endpoint);
    Outcome out_once(Pid pid, uint8_t endpoint, const Bytes &packet);
    Outcome out_retried(Pid pid, uint8_t endpoint, const Bytes &packet);
    Outcome handshake();
    Outcome irregular(PacketError error, bool deliberate);
    bool use(WireFault fault);

    UsbBus bus_;
    Bytes packet_;
    std::array<bool, 16> toggle_in_{};
    std::array<bool, 16> toggle_out_{};
    std::array<bool, 16> copy_due_{}; // the last ACK was lost on purpose
    uint8_t address_ = 0;
    uint16_t microframe_ = 0;
    WireFault armed_ = WireFault::NONE;
    HostCounters counters_;
};

} // namespace bridge_sim
