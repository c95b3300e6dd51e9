#include "usb_bus.h"

namespace bridge_sim
{

namespace
{

constexpr uint64_t CYCLES_PER_MS = 60000;
// High-speed time-out: 736 to 816 bit times of 1/480 us (USB 2.0, 7.1.19.2), eight bits a cycle.
constexpr int TIMEOUT_CYCLES = 102;
// Reset: a high-speed device falls back to full speed after 3 ms of SE0, then chirps within 6 ms (7.1.7.5).
constexpr uint64_t RESET_LIMIT = 10 * CYCLES_PER_MS;
// Chirps of the hub: 40 to 60 us each (7.1.7.5), far shorter here; the device only counts three pairs.
constexpr uint64_t HUB_CHIRP = 400;
constexpr int HUB_CHIRP_PAIRS = 6;
constexpr uint8_t OP_MODE_CHIRP = 2;
// A device gives a hub 1 to 2.5 ms to answer its chirp (7.1.7.5).
constexpr uint64_t CHIRP_PATIENCE = 3 * CYCLES_PER_MS;
// 3 ms of idle, then up to 0.875 ms to tell suspend from reset (7.1.7.6).
constexpr uint64_t SUSPEND_CYCLES = 4 * CYCLES_PER_MS;
// The host ends K with two low-speed bit times of SE0 (7.1.7.7).
constexpr uint64_t END_OF_RESUME = 80;

} // namespace

UsbBus::UsbBus(UtmiDevice &device) : device_(device)
{
}

// With its full-speed pull-up on, as asleep, the device itself makes the idle line J.
uint8_t UsbBus::idle_line() const
{
    return high_speed_ && !device_.out.term_select ? LINE_SE0 : LINE_J;
}

void UsbBus::hold_line(uint8_t line, uint64_t cycles)
{
    device_.in.line_state = line;
    while (cycles-- > 0) {
        device_.cycle();
    }
}

void UsbBus::idle(uint64_t cycles)
{
    while (cycles-- > 0) {
        hold_line(idle_line(), 1);
        unasked_ = unasked_ || device_.out.tx_valid;
    }
}

bool UsbBus::take_unasked()
{
    const bool unasked = unasked_;
    unasked_ = false;
    return unasked;
}

bool UsbBus::hold_line_until_transmit(uint8_t line, bool level)
{
    device_.in.line_state = line;
    for (uint64_t i = 0; i < RESET_LIMIT; i++) {
        device_.cycle();
        const bool chirping = device_.out.tx_valid && device_.out.op_mode == OP_MODE_CHIRP;
        if (chirping == level) {
            return true;
        }
    }
    return false;
}

bool UsbBus::at_speed(bool high) const
{
    const uint8_t select = high ? 0 : 1; // of UTMI's transceivers and terminations
    return device_.out.xcvr_select == select && device_.out.term_select == select;
}

bool UsbBus::chirp(BusSpeed speed)
{
    if (!hold_line_until_transmit(LINE_SE0, true) || !hold_line_until_transmit(LINE_K, false)) {
        return false;
    }
    if (speed == BusSpeed::FULL) {
        hold_line(LINE_SE0, CHIRP_PATIENCE);
        return true;
    }
    hold_line(LINE_SE0, PACKET_GAP);
    for (int pair = 0; pair < HUB_CHIRP_PAIRS; pair++) {
        hold_line(LINE_K, HUB_CHIRP);
        hold_line(LINE_J, HUB_CHIRP);
    }
    hold_line(LINE_SE0, HUB_CHIRP);
    return true;
}

bool UsbBus::reset(BusSpeed speed)
{
    device_.in.rx_active = device_.in.rx_valid = 0;
    device_.in.tx_ready = 1; // a PHY goes on taking what the device was sending
    high_speed_ = chirp(speed) && speed == BusSpeed::HIGH;
    device_.in.tx_ready = 0;
    unasked_ = false;
    idle(PACKET_GAP);
    return at_speed(speed == BusSpeed::HIGH);
}

bool UsbBus::suspend()
{
    for (uint64_t i = 0; i < SUSPEND_CYCLES; i++) {
        hold_line(idle_line(), 1);
    }
    return at_speed(false);
}

bool UsbBus::resume(uint64_t cycles)
{
    bool patient = true;
    for (uint64_t i = 0; i < cycles; i++) {
        hold_line(LINE_K, 1);
        patient = patient && at_speed(false);
    }
    hold_line(LINE_SE0, END_OF_RESUME);
    const bool back = at_speed(high_speed_);
    idle(PACKET_GAP);
    return patient && back;
}

void UsbBus::send(const Bytes &packet)
{
    device_.in.line_state = LINE_J;
    device_.in.rx_active = 1;
    device_.cycle();
    device_.in.rx_valid = 1;
    for (const uint8_t byte : packet) {
        device_.in.rx_data = byte;
        device_.cycle();
    }
    device_.in.rx_valid = 0;
    device_.in.rx_active = 0;
    device_.cycle();
    device_.in.line_state = idle_line();
}

bool UsbBus::wait_for_packet()
{
    for (int waited = 0; waited <= TIMEOUT_CYCLES; waited++) {
        device_.cycle();
        if (device_.out.tx_valid) {
            return true;
        }
    }
    return false;
}

bool UsbBus::receive(size_t limit, Bytes &packet)
{
    packet.clear();
    if (!wait_for_packet()) {
        return false;
    }
    device_.in.line_state = LINE_J;
    device_.in.tx_ready = 1;
    for (device_.cycle(); device_.out.tx_valid && packet.size() < 2 * limit; device_.cycle()) {
        packet.push_back(device_.out.tx_data);
    }
    device_.in.tx_ready = 0;
    device_.in.line_state = idle_line();
    return true;
}

} // namespace bridge_sim
