#include "nor_flash.h"

#include <algorithm>
#include <stdexcept>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

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
constexpr uint8_t IDENTITY[] = {0xEF, 0x40, 0x14};
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

NorFlash::~NorFlash()
{
    if (file_ >= 0) {
        close(file_);
    }
}

void NorFlash::keep_in(const std::string &path)
{
    struct stat about {
    };
    file_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (file_ < 0 || fstat(file_, &about) != 0) {
        throw std::runtime_error("--flash '" + path + "': cannot be opened; give a file that can be written");
    }
    if (about.st_size == 0) {
        save(0, SIZE);
    } else if (about.st_size != SIZE || pread(file_, content_.data(), SIZE, 0) != static_cast<ssize_t>(SIZE)) {
        throw std::runtime_error("--flash '" + path + "': is not " + std::to_string(SIZE) +
                                 " bytes long; give another, or one that is not there yet");
    }
}

void NorFlash::save(uint32_t address, uint32_t count) const
{
    if (file_ >= 0 && pwrite(file_, content_.data() + address, count, address) != static_cast<ssize_t>(count)) {
        throw std::runtime_error("--flash: the file cannot be written; make room for it");
    }
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
    if (opcode == IDENTIFY && sent <= std::size(IDENTITY)) {
        return IDENTITY[sent - 1];
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

void NorFlash::erase(uint32_t address)
{
    write((address % SIZE) / SECTOR * SECTOR, Bytes(SECTOR, 0xFF));
}

void NorFlash::program(uint32_t address, const Bytes &data)
{
    const uint32_t page = (address % SIZE) / PAGE * PAGE;
    Bytes content(content_.begin() + page, content_.begin() + page + PAGE);
    for (size_t i = 0; i < data.size(); i++) {
        content[(address + i) % PAGE] &= data[i];
    }
    write(page, content);
}

void NorFlash::cut_after(uint64_t writes)
{
    writes_left_ = writes;
}

void NorFlash::write(uint32_t address, const Bytes &content)
{
    const bool cut = writes_left_-- == 0;
    std::copy_n(content.begin(), cut ? content.size() / 2 : content.size(), content_.begin() + address);
    save(address, static_cast<uint32_t>(content.size()));
    if (cut) {
        throw std::runtime_error("--flash-cut: power went while the flash was written");
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
