// USB 2.0 packets as bytes: identifiers, CRCs (chapter 8.3), building and checking. No timing, no state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace bridge_sim
{

using Bytes = std::vector<uint8_t>;

// Packet identifiers with their complement in the high half, USB 2.0 table 8-1.
enum Pid : uint8_t {
    PID_OUT = 0xE1,
    PID_IN = 0x69,
    PID_SOF = 0xA5,
    PID_SETUP = 0x2D,
    PID_DATA0 = 0xC3,
    PID_DATA1 = 0x4B,
    PID_ACK = 0xD2,
    PID_NAK = 0x5A,
    PID_STALL = 0x1E
};

enum class PacketError { NONE, EMPTY, PID, LENGTH, CRC };

// CRC-5 of the low 11 bits of a token, as sent: bits 4..0, inverted (USB 2.0, 8.3.5.1).
uint8_t usb_crc5(uint16_t eleven_bits);

// CRC-16 of a data packet's payload, as sent: low byte first, inverted (USB 2.0, 8.3.5.2).
uint16_t usb_crc16(const uint8_t *bytes, size_t count);

// Three bytes of an IN, OUT, SETUP or SOF token; `value` holds address and endpoint, or the frame number.
Bytes token_packet(Pid pid, uint16_t value);

// A data packet; toggle false: DATA0, true: DATA1.
Bytes data_packet(bool toggle, const uint8_t *payload, size_t count);

// Is this a well-formed handshake? Then its identifier is packet[0].
PacketError check_handshake(const Bytes &packet);

// Is this a well-formed DATA0 or DATA1 packet of at most `limit` payload bytes?
PacketError check_data(const Bytes &packet, size_t limit);

// Does the identifier's high half complement its low half?
bool pid_is_sound(uint8_t pid);

} // namespace bridge_sim
