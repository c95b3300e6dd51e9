#include "usb_packet.h"

#include <array>

namespace bridge_sim
{

namespace
{

constexpr size_t DATA_OVERHEAD = 3; // identifier and CRC-16

std::array<uint16_t, 256> usb_packet_make_crc16_table()
{
    std::array<uint16_t, 256> table{};
    for (unsigned i = 0; i < table.size(); i++) {
        unsigned value = i;
        for (int bit = 0; bit < 8; bit++) {
            value = (value & 1u) ? (value >> 1) ^ 0xA001u : value >> 1;
        }
        table[i] = static_cast<uint16_t>(value);
    }
    return table;
}

} // namespace

uint8_t usb_crc5(uint16_t eleven_bits)
{
    unsigned crc = 0x1F;
    for (unsigned bit = 0; bit < 11; bit++) {
        const unsigned feedback = ((eleven_bits >> bit) ^ crc) & 1u;
        crc = (crc >> 1) ^ (feedback ? 0x14u : 0u);
    }
    return static_cast<uint8_t>(~crc & 0x1Fu);
}

uint16_t usb_crc16(const uint8_t *bytes, size_t count)
{
    static const std::array<uint16_t, 256> table = usb_packet_make_crc16_table();
    unsigned crc = 0xFFFF;
    for (size_t i = 0; i < count; i++) {
        crc = (crc >> 8) ^ table[(crc ^ bytes[i]) & 0xFFu];
    }
    return static_cast<uint16_t>(~crc & 0xFFFFu);
}

Bytes token_packet(Pid pid, uint16_t value)
{
    const unsigned word = (value & 0x7FFu) | static_cast<unsigned>(usb_crc5(value)) << 11;
    return {pid, static_cast<uint8_t>(word & 0xFFu), static_cast<uint8_t>(word >> 8)};
}

Bytes data_packet(bool toggle, const uint8_t *payload, size_t count)
{
    Bytes packet;
    packet.reserve(count + DATA_OVERHEAD);
    packet.push_back(toggle ? PID_DATA1 : PID_DATA0);
    packet.insert(packet.end(), payload, payload + count);
    const uint16_t crc = usb_crc16(payload, count);
    packet.push_back(static_cast<uint8_t>(crc & 0xFFu));
    packet.push_back(static_cast<uint8_t>(crc >> 8));
    return packet;
}

bool pid_is_sound(uint8_t pid)
{
    return ((pid >> 4) ^ (pid & 0xFu)) == 0xFu;
}

PacketError check_handshake(const Bytes &packet)
{
    if (packet.empty()) {
        return PacketError::EMPTY;
    }
    const bool known = packet[0] == PID_ACK || packet[0] == PID_NAK || packet[0] == PID_STALL;
    if (!known) {
        return PacketError::PID;
    }
    return packet.size() == 1 ? PacketError::NONE : PacketError::LENGTH;
}

PacketError check_data(const Bytes &packet, size_t limit)
{
    if (packet.empty()) {
        return PacketError::EMPTY;
    }
    if (packet[0] != PID_DATA0 && packet[0] != PID_DATA1) {
        return PacketError::PID;
    }
    if (packet.size() < DATA_OVERHEAD || packet.size() > limit + DATA_OVERHEAD) {
        return PacketError::LENGTH;
    }
    const size_t count = packet.size() - DATA_OVERHEAD;
    const unsigned sent = packet[count + 1] | static_cast<unsigned>(packet[count + 2]) << 8;
    return usb_crc16(packet.data() + 1, count) == sent ? PacketError::NONE : PacketError::CRC;
}

} // namespace bridge_sim
