#include "nor_flash.h"

#include <algorithm>

namespace bridge_sim
{

namespace
{

constexpr uint8_t ENABLE = 0x06, STATUS = 0x05, IDENTIFY = 0x9F, READ = 0x03, ERASE = 0x20, PROGRAM = 0x02;
constexpr uint8_t BUSY = 1;
constexpr size_t ADDRESS_END = 4;                    // opcode and address
constexpr unsigned ERASE_TIME = 3, PROGRAM_TIME = 1; // in questions, as a host would not wait for a real one's 45 ms
constexpr uint32_t FALLBACK = uint32_t{NorFlash::WRITABLE_SECTORS} << 16, JUMP = NorFlash::SIZE - NorFlash::PAGE;
constexpr uint8_t PREAMBLE[] = {0xFF, 0xFF, 0xBD, 0xB3}; // of an ECP5's bitstream
constexpr uint8_t JUMP_OPCODE = 0x7E;

uint32_t address_of(const Bytes &received)
{
    return static_cast<uint32_t>(received[1] << 16 | received[2] << 8 | received[3]) % NorFlash::SIZE;
}

} // namespace

NorFlash::NorFlash() : content_(SIZE, 0xFF)
{
    for (const uint32_t start : {FALLBACK, JUMP}) {
        std::copy(std::begin(PREAMBLE), std::end(PREAMBLE), content_.begin() + start);
    }
    const Bytes jump = {JUMP_OPCODE, 0, 0, 0, 3, WRITABLE_SECTORS, 0, 0};
    std::copy(jump.begin(), jump.end(), content_.begin() + JUMP + 8);
}

uint8_t NorFlash::answer(const Bytes &received)
{
    const uint8_t opcode = received[0];
    if (opcode == STATUS) {
        return busy_ ? BUSY : 0;
    }
    if (busy_) {
        return 0xFF;
    }
    const size_t sent = received.size();
    if (opcode == IDENTIFY && sent <= identify().size()) {
        return identify()[sent - 1];
    }
    if (opcode == READ && sent >= ADDRESS_END) {
        return content_[(address_of(received) + sent - ADDRESS_END) % SIZE];
    }
    return 0xFF;
}

void NorFlash::act(const Bytes &received)
{
    const uint8_t opcode = received[0];
    if (opcode == STATUS) {
        busy_ -= busy_ > 0;
        return;
    }
    if (busy_) {
        return;
    }
    const bool writes = (opcode == ERASE || opcode == PROGRAM) && enabled_ && received.size() >= ADDRESS_END;
    if (writes && opcode == ERASE) {
        erase(address_of(received));
        busy_ = ERASE_TIME;
    } else if (writes) {
        program(address_of(received), {received.begin() + ADDRESS_END, received.end()});
        busy_ = PROGRAM_TIME;
    }
    enabled_ = opcode == ENABLE;
}

Bytes NorFlash::identify() const
{
    return {0xEF, 0x40, 0x14};
}

Bytes NorFlash::read(uint32_t address, size_t count) const
{
    Bytes out(count);
    for (size_t i = 0; i < count; i++) {
        out[i] = content_[(address + i) % SIZE];
    }
    return out;
}

void NorFlash::erase(uint32_t address)
{
    const auto start = content_.begin() + (address % SIZE) / SECTOR * SECTOR;
    std::fill(start, start + SECTOR, 0xFF);
}

void NorFlash::program(uint32_t address, const Bytes &data)
{
    const uint32_t page = (address % SIZE) / PAGE * PAGE;
    for (size_t i = 0; i < data.size(); i++) {
        content_[page + (address + i) % PAGE] &= data[i];
    }
}

void NorFlash::power_cycle()
{
    enabled_ = false;
    busy_ = 0;
}

void FlashPins::edge(bool cs_n, bool sck, bool mosi)
{
    if (cs_n && !cs_n_ && !received_.empty()) {
        flash_.act(received_);
    }
    if (cs_n || cs_n_) {
        received_.clear();
        bits_ = 0;
        out_ = 0xFF;
    } else if (sck && !sck_) {
        in_ = static_cast<uint8_t>(in_ << 1 | mosi);
        bits_ = (bits_ + 1) % 8;
        if (bits_ == 0) {
            received_.push_back(in_);
            out_ = flash_.answer(received_);
        }
    } else if (!sck && sck_) {
        miso_ = out_ >> (7 - bits_) & 1u;
    }
    cs_n_ = cs_n;
    sck_ = sck;
}

} // namespace bridge_sim
