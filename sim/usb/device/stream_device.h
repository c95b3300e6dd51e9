// A USB device whose frames come from a function: what the device on UTMI and the one behind a ULPI PHY have in common.
#pragma once

#include <functional>

#include "utmi.h"

namespace bridge_sim
{

class StreamDevice : public UtmiDevice
{
  public:
    // Byte `index` (from 0) of the stream since the last restart, and whether the stream has it yet.
    std::function<uint8_t(uint64_t index)> byte;
    uint64_t available = 0; // bytes of the stream that may be taken

    uint64_t taken() const;    // bytes the device took since the last restart
    uint64_t restarts() const; // times it asked to begin anew (rising edges)
    virtual bool suspended() const = 0;

    // Cycles at high speed from the end of a packet to the beginning of the answer: the most so far (0: none yet), and
    // the most there may be.
    unsigned slowest_answer() const;
    virtual unsigned answer_limit() const = 0;

  protected:
    // One cycle of the model with its other inputs set: the stream's pins, then the clock, low and high. Between the
    // two `at_edge` sees the levels at the rising edge.
    template <typename Top, typename AtEdge> void clock(Top &top, AtEdge at_edge)
    {
        top.stream_valid = taken_ < available;
        top.stream_data = top.stream_valid ? byte(taken_) : 0;
        top.clk = 0;
        top.eval();
        at_edge();
        move(top.stream_valid && top.stream_ready, top.restart);
        top.clk = 1;
        top.eval();
        cycles++;
    }

    // Power-up: forgets the restart that comes with it.
    template <typename Top> void power_up(Top &top)
    {
        constexpr int RESET_CYCLES = 16;
        top.rst = 1;
        for (int i = 0; i < RESET_CYCLES; i++) {
            cycle();
        }
        top.rst = 0;
        cycle();
        restarts_ = 0;
    }

    void answered_after(unsigned waited);

  private:
    void move(bool moved, bool restart);

    uint64_t taken_ = 0;
    uint64_t restarts_ = 0;
    bool restarting_ = false;
    unsigned slowest_ = 0;
};

} // namespace bridge_sim
