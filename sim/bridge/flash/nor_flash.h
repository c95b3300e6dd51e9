// The bridge's configuration flash: a serial NOR flash of 1 MiB as data sheets have it, transaction by transaction. It
// writes only what write enable allowed before, wraps within a page, clears bits and never sets them but by erasing a
// sector, and while it is busy it hears nothing but the question whether it is.
#pragma once

#include <string>

#include "usb_packet.h"

namespace bridge_sim
{

class NorFlash
{
  public:
    static constexpr uint32_t SIZE = 1u << 20, SECTOR = 4096, PAGE = 256;
    // Sectors of 64 KiB that the simulated bridge may write; the image to fall back to begins behind them.
    static constexpr uint8_t WRITABLE_SECTORS = 4;

    // Erased but for the image to fall back to and the jump that leads there, whose first bytes are those of any.
    NorFlash();
    ~NorFlash();
    NorFlash(const NorFlash &) = delete;
    NorFlash &operator=(const NorFlash &) = delete;

    // From now on the content is that of a file, which is made if there is none, and follows every change. Throws
    // std::runtime_error with one line.
    void keep_in(const std::string &path);

    // Power goes in the midst of the write after so many: half of it is done, and std::runtime_error is thrown.
    void cut_after(uint64_t writes);

    // The byte that the chip puts out after those that came so far, in this transaction.
    uint8_t answer(const Bytes &received);

    // The transaction is over.
    void act(const Bytes &received);

    // Power went: what was under way is over.
    void power_cycle();

  private:
    void erase(uint32_t address);
    void program(uint32_t address, const Bytes &data);
    void write(uint32_t address, const Bytes &content);
    void save(uint32_t address, uint32_t count) const;

    int file_ = -1;
    uint64_t writes_left_ = UINT64_MAX;
    Bytes content_;
    bool enabled_ = false;
    unsigned busy_ = 0; // how often it will say so
};

// The same at its pins, SPI mode 0. Called in every clock cycle.
class FlashPins
{
  public:
    explicit FlashPins(NorFlash &flash) : flash_(flash)
    {
    }

    // Levels of the bridge's outputs now; returns MISO.
    bool step(bool cs_n, bool sck, bool mosi)
    {
        if (cs_n != cs_n_ || sck != sck_) {
            edge(cs_n, sck, mosi);
        }
        return miso_;
    }

  private:
    void edge(bool cs_n, bool sck, bool mosi);

    NorFlash &flash_;
    Bytes received_;
    uint8_t in_ = 0, out_ = 0xFF;
    unsigned bits_ = 0; // of the byte under way
    bool cs_n_ = true, sck_ = false, miso_ = true;
};

} // namespace bridge_sim
