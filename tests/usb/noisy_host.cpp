#include "noisy_host.h"

namespace bridge_sim
{

namespace
{

constexpr size_t BABBLE_BYTES = 1500;
constexpr size_t ANSWER_LIMIT = 600;
constexpr uint8_t BULK = 1;

} // namespace

NoisyHost::NoisyHost(UsbHost &host, uint64_t seed) : host_(host), generator_(seed)
{
}

uint64_t NoisyHost::below(uint64_t bound)
{
    return generator_() % bound;
}

Noise NoisyHost::draw()
{
    return static_cast<Noise>(below(static_cast<uint64_t>(Noise::KINDS)));
}

Bytes NoisyHost::random_bytes(size_t count)
{
    Bytes bytes(count);
    for (uint8_t &byte : bytes) {
        byte = static_cast<uint8_t>(generator_());
    }
    return bytes;
}

Bytes NoisyHost::token(Pid pid, uint8_t address, uint8_t endpoint) const
{
    return token_packet(pid, static_cast<uint16_t>(address | endpoint << 7));
}

void NoisyHost::send(const Bytes &packet)
{
    host_.bus().send(packet);
    host_.bus().idle(PACKET_GAP);
}

bool NoisyHost::silent()
{
    Bytes answer;
    const bool answered = host_.bus().receive(ANSWER_LIMIT, answer);
    host_.bus().idle(PACKET_GAP);
    return !answered;
}

bool NoisyHost::make(Noise noise)
{
    const uint8_t mine = host_.address();
    const uint8_t other = static_cast<uint8_t>((mine + 1 + below(126)) & 0x7Fu);
    const Bytes payload = random_bytes(below(64));
    Bytes data = data_packet(below(2) != 0, payload.data(), payload.size());
    switch (noise) {
    case Noise::JUNK: {
        Bytes junk = random_bytes(4 + below(16)); // longer than a token or handshake, so never one
        junk[0] &= 0xF0u;                         // and no identifier of data
        send(junk);
        break;
    }
    case Noise::FRAGMENT: {
        Bytes whole = below(2) ? token(PID_IN, mine, BULK) : data;
        whole.resize(below(3));
        send(whole);
        break;
    }
    case Noise::BAD_CRC_DATA:
        send(token(PID_OUT, mine, 0));
        data.back() ^= 1u;
        send(data);
        break;
    case Noise::LONE_DATA:
        send(token(PID_OUT, other, 0));
        send(data);
        send(data);
        break;
    case Noise::BABBLE:
        send(random_bytes(1));
        data.resize(BABBLE_BYTES, 0x55);
        send(data);
        break;
    case Noise::OTHERS_IN:
        send(token(PID_IN, other, BULK));
        send(data);
        send({PID_ACK});
        break;
    case Noise::LONE_ACK: {
        Bytes damaged = token(PID_IN, other, BULK);
        damaged[2] ^= 0x80u;
        send(damaged);
        send({PID_ACK});
        break;
    }
    default:
        send(token(PID_SETUP, mine, BULK));
        send(data_packet(false, random_bytes(8).data(), 8));
        break;
    }
    return silent();
}

} // namespace bridge_sim
