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

} // namespace

UsbBus::UsbBus(UtmiDevice &device) : device_(device)
{
}

uint8_t UsbBus::idle_line() const
{
    return high_speed_ ? LINE_SE0 : LINE_J;
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
    hold_line(idle_line(), cycles);
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

bool UsbBus::chirp()
{
    if (!hold_line_until_transmit(LINE_SE0, true) || !hold_line_until_transmit(LINE_K, false)) {
        return false;
    }
    hold_line(LINE_SE0, PACKET_GAP);
    for (int pair = 0; pair < HUB_CHIRP_PAIRS; pair++) {
        hold_line(LINE_K, HUB_CHIRP);
        hold_line(LINE_J, HUB_CHIRP);
    }
    hold_line(LINE_SE0, HUB_CHIRP);
    return device_.out.xcvr_select == 0 && device_.out.term_select == 0;
}

bool UsbBus::reset()
{
    high_speed_ = chirp();
    idle(PACKET_GAP);
    return high_speed_;
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
