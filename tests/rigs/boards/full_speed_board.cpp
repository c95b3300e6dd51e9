#include "full_speed_board.h"

#include <stdexcept>

#include "Vulx3s_bench.h"
#include "Vulx3s_bench___024root.h"

namespace bridge_sim
{

namespace
{

constexpr uint64_t UNITS = 4;                       // of 240 MHz in a cycle of 60 MHz
constexpr uint64_t SAMPLING = 5, SAMPLING_HIGH = 2; // in one of 48 MHz
constexpr uint64_t OSCILLATOR_HALF = 50;            // 2.4 MHz
constexpr uint32_t ALL_LANES = UINT32_MAX >> (32 - LANES);

} // namespace

FullSpeedBoard::FullSpeedBoard(NodeBus &nodes, bool swapped)
    : nodes_(nodes), swapped_(swapped), top_(std::make_unique<Vulx3s_bench>()),
      wire_([this](bool p, bool n) { return step(p, n); })
{
    top_->miso = ALL_LANES;
    out.xcvr_select = 1;
}

FullSpeedBoard::~FullSpeedBoard() = default;

uint8_t FullSpeedBoard::leds() const
{
    return top_->leds;
}

bool FullSpeedBoard::bus_is_idle() const
{
    return !top_->sync && !top_->sck && top_->select_n;
}

// Both clocks for one cycle of 60 MHz.
void FullSpeedBoard::edges()
{
    auto &root = *top_->rootp;
    for (uint64_t unit = 0; unit < UNITS; unit++, units_++) {
        root.ulx3s_bench__DOT__board__DOT__pll__DOT__CLKOP = unit < UNITS / 2;
        root.ulx3s_bench__DOT__board__DOT__oscillator__DOT__OSC = units_ / OSCILLATOR_HALF % 2 != 0;
        root.ulx3s_bench__DOT__board__DOT__pll__DOT__CLKOS = units_ % SAMPLING < SAMPLING_HIGH;
        top_->eval();
    }
    cycles++;
}

LinePair FullSpeedBoard::step(bool p, bool n)
{
    Vulx3s_bench &top = *top_;
    top.host_p = swapped_ ? n : p;
    top.host_n = swapped_ ? p : n;
    edges();
    top.miso = nodes_.pins(top.sync, top.select_n, top.sck, top.mosi) & ALL_LANES;
    if (busy_ && top.select_n) {
        nodes_.run();
    }
    busy_ = !top.select_n;
    // A pull-up at D- would be a low-speed device's.
    out.term_select = top.pull_up && !swapped_;
    return {top.device_p != 0, top.device_n != 0, top.device_drives != 0};
}

void FullSpeedBoard::send()
{
    if (!in.rx_active) {
        sending_ = false;
        wire_.send_end();
        return;
    }
    if (!sending_) {
        sending_ = true;
        wire_.send_sync();
    }
    if (in.rx_valid) {
        wire_.send(in.rx_data);
    }
}

void FullSpeedBoard::idle()
{
    const bool reset = in.line_state == LINE_SE0;
    if (!wire_.hold(!reset && in.line_state != LINE_K, in.line_state == LINE_K)) {
        return;
    }
    if (reset) {
        throw std::runtime_error("the device drives the cable in a reset");
    }
    receiving_ = wire_.receive_sync() && wire_.receive(byte_);
    out.tx_valid = receiving_;
    out.tx_data = byte_;
}

void FullSpeedBoard::receive()
{
    out.tx_valid = receiving_;
    out.tx_data = byte_;
    if (in.tx_ready) {
        receiving_ = wire_.receive(byte_);
    }
}

void FullSpeedBoard::cycle()
{
    if (receiving_) {
        receive();
    } else if (in.rx_active || sending_) {
        send();
    } else {
        out.tx_valid = false;
        idle();
    }
}

} // namespace bridge_sim
