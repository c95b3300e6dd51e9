// A long run of frames through the USB device with faults on the wire, resets and requests at random: what the host
// accepts must be what the device was given since the last restart, byte for byte.
#pragma once

#include "noisy_host.h"
#include "stream_device.h"
#include "usb_control.h"

namespace bridge_sim
{

struct SoakResult {
    uint64_t frames = 0;  // accepted by the host
    uint64_t packets = 0; // with data
    uint64_t gaps = 0;
    uint64_t duplicates = 0;
    uint64_t wrong = 0;       // packets with bytes never sent
    uint64_t stale = 0;       // packets from before a restart
    uint64_t wire_faults = 0; // lost ACKs, damaged tokens, data and SETUPs
    uint64_t noise = 0;       // packets that were not for the device
    uint64_t answered = 0;    // of these
    uint64_t resets = 0;      // of the bus, at any cycle of a transaction
    uint64_t restarts = 0;    // by SET_CONFIGURATION or halt
    uint64_t unexplained = 0; // irregular answers that no deliberate fault explains
    uint64_t hangs = 0;       // requests that failed, or data that did not come
    uint64_t cycles = 0;

    bool clean() const;
};

class FrameSoak
{
  public:
    // The device, fresh from power-up, must outlive the soak.
    FrameSoak(StreamDevice &device, uint64_t seed);

    // Goes on until the host has accepted this many frames, or something hung.
    const SoakResult &run(uint64_t frames);

  private:
    void step();
    void disturb();
    void arm();
    void make_noise();
    void request();
    void halt_and_clear();
    void configure();
    void reset_at_any_cycle();
    void enumerate_device();
    void begin_stream();
    void read_packet();
    void take(const Bytes &packet);
    uint8_t byte_of(uint64_t stream, uint64_t index) const;
    void expect(bool condition);

    StreamDevice &device_;
    UsbHost host_;
    NoisyHost noise_;
    SoakResult result_;
    uint64_t stream_ = 0;       // restarts so far: each has frames of its own
    uint64_t accepted_ = 0;     // bytes of this stream
    unsigned quiet_ = 0;        // NAKs in a row while data was due
    bool copy_pending_ = false; // the last ACK was lost
};

} // namespace bridge_sim
