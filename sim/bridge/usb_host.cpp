#include "usb_host.h"

namespace bridge_sim
{

namespace
{

constexpr uint64_t CYCLES_PER_MS = 60000;
// High-speed time-out: 736 to 816 bit times of 1/480 us (USB 2.0, 7.1.19.2), eight bits a cycle.
constexpr int TIMEOUT_CYCLES = 102;
// Quiet time between two packets: more than the 88 bit times a high-speed host keeps (USB 2.0, 7.1.18.2).
constexpr uint64_t PACKET_GAP = 12;
// Time a device needs to see the end of its own packet before the host's handshake.
constexpr uint64_t HANDSHAKE_GAP = 4;
// A host controller gives a transaction up after three errors in a row.
constexpr int ATTEMPTS = 3;
// Reset: a high-speed device falls back to full speed after 3 ms of SE0, then chirps within 6 ms (7.1.7.5).
constexpr uint64_t RESET_LIMIT = 10 * CYCLES_PER_MS;
// Chirps of the hub: 40 to 60 us each (7.1.7.5), far shorter here; the device only counts three pairs.
constexpr uint64_t HUB_CHIRP = 400;
constexpr int HUB_CHIRP_PAIRS = 6;
constexpr uint8_t OP_MODE_CHIRP = 2;

bool final_outcome(Outcome outcome)
{
    return outcome == Outcome::OK || outcome == Outcome::NAK || outcome == Outcome::STALL;
}

} // namespace

UsbHost::UsbHost(UtmiDevice &device) : device_(device)
{
}

const HostCounters &UsbHost::counters() const
{
    return counters_;
}

// --------------------------------------------------------------------------------------------------------- the line

void UsbHost::hold_line(uint8_t line, uint64_t cycles)
{
    device_.in.line_state = line;
    while (cycles-- > 0) {
        device_.cycle();
    }
}

bool UsbHost::hold_line_until_transmit(uint8_t line, bool level)
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

void UsbHost::rest()
{
    device_.in.line_state = high_speed_ ? LINE_SE0 : LINE_J;
}

void UsbHost::idle(uint64_t cycles)
{
    hold_line(high_speed_ ? LINE_SE0 : LINE_J, cycles);
}

bool UsbHost::chirp()
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

bool UsbHost::reset()
{
    high_speed_ = chirp();
    address_ = 0;
    toggle_in_.fill(false);
    toggle_out_.fill(false);
    copy_due_.fill(false);
    idle(PACKET_GAP);
    return high_speed_;
}

// ------------------------------------------------------------------------------------------------------ raw packets

void UsbHost::send(const Bytes &packet)
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
    rest();
}

// Collects one packet of the device in packet_; false: nothing came in time. Reads a babbler to its end, up to a bound.
bool UsbHost::receive(size_t limit)
{
    packet_.clear();
    device_.cycle();
    for (int waited = 0; !device_.out.tx_valid; waited++) {
        if (waited == TIMEOUT_CYCLES) {
            return false;
        }
        device_.cycle();
    }
    device_.in.line_state = LINE_J;
    device_.in.tx_ready = 1;
    for (device_.cycle(); device_.out.tx_valid && packet_.size() < 2 * limit; device_.cycle()) {
        packet_.push_back(device_.out.tx_data);
    }
    device_.in.tx_ready = 0;
    rest();
    return true;
}

void UsbHost::send_token(Pid pid, uint8_t endpoint, bool spoil)
{
    Bytes token = token_packet(pid, static_cast<uint16_t>(address_ | endpoint << 7));
    if (spoil) {
        token[2] ^= 0x80u; // one bit of the CRC-5
    }
    send(token);
}

void UsbHost::start_of_frame()
{
    send(token_packet(PID_SOF, static_cast<uint16_t>((microframe_++ >> 3) & 0x7FFu)));
    idle(PACKET_GAP);
}

// ------------------------------------------------------------------------------------------- errors, meant and unmeant

void UsbHost::arm(WireFault fault)
{
    armed_ = fault;
}

WireFault UsbHost::armed() const
{
    return armed_;
}

bool UsbHost::use(WireFault fault)
{
    if (armed_ != fault) {
        return false;
    }
    armed_ = WireFault::NONE;
    counters_.injected++;
    return true;
}

Outcome UsbHost::irregular(PacketError error, bool deliberate)
{
    counters_.unexplained += deliberate ? 0 : 1;
    switch (error) {
    case PacketError::CRC:
        counters_.crc_errors++;
        return Outcome::CRC;
    case PacketError::LENGTH:
        counters_.babbles++;
        return Outcome::BABBLE;
    case PacketError::EMPTY:
        counters_.timeouts++;
        return Outcome::TIMEOUT;
    default:
        counters_.pid_errors++;
        return Outcome::PID;
    }
}

void UsbHost::expect_silence()
{
    if (receive(sizeof(uint64_t))) {
        counters_.violations++;
        counters_.unexplained++;
    }
    idle(PACKET_GAP);
}

void UsbHost::spoiled_token(uint8_t endpoint)
{
    send_token(PID_IN, endpoint, true);
    expect_silence();
}

void UsbHost::spoiled_setup(const Bytes &packet)
{
    Bytes spoiled = packet;
    spoiled.back() ^= 0x01u;
    send_token(PID_SETUP, 0, false);
    idle(PACKET_GAP);
    send(spoiled);
    expect_silence();
    setup_may_be_lost_ = true;
}

// --------------------------------------------------------------------------------------------------------------- IN

Outcome UsbHost::in(uint8_t endpoint, size_t limit, Bytes &data)
{
    if (use(WireFault::BAD_TOKEN)) {
        spoiled_token(endpoint);
    }
    Outcome outcome = Outcome::TIMEOUT;
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        bool duplicate = false;
        outcome = in_once(endpoint, limit, data, duplicate);
        idle(PACKET_GAP);
        if (final_outcome(outcome) && !duplicate) {
            return outcome;
        }
    }
    return outcome;
}

Outcome UsbHost::in_once(uint8_t endpoint, size_t limit, Bytes &data, bool &duplicate)
{
    counters_.transactions++;
    send_token(PID_IN, endpoint, false);
    if (!receive(limit)) {
        return irregular(PacketError::EMPTY, false);
    }
    if (packet_.size() == 1) {
        const Outcome answer = handshake();
        return answer == Outcome::OK ? irregular(PacketError::PID, false) : answer; // ACK is no answer to IN
    }
    const bool spoil = use(WireFault::BAD_DATA);
    if (spoil) {
        packet_.back() ^= 0x10u;
    }
    const PacketError error = check_data(packet_, limit);
    return error == PacketError::NONE ? take_data(endpoint, data, duplicate) : irregular(error, spoil);
}

Outcome UsbHost::take_data(uint8_t endpoint, Bytes &data, bool &duplicate)
{
    const bool toggle = packet_[0] == PID_DATA1;
    duplicate = toggle != toggle_in_[endpoint];
    if (duplicate) {
        counters_.duplicates++;
        counters_.unexplained += copy_due_[endpoint] ? 0 : 1;
    } else {
        toggle_in_[endpoint] = !toggle_in_[endpoint];
        data.assign(packet_.begin() + 1, packet_.end() - 2);
    }
    acknowledge(endpoint);
    return Outcome::OK;
}

void UsbHost::acknowledge(uint8_t endpoint)
{
    copy_due_[endpoint] = use(WireFault::LOST_ACK);
    if (!copy_due_[endpoint]) {
        idle(HANDSHAKE_GAP);
        send({PID_ACK});
    }
}

// ------------------------------------------------------------------------------------------------------ OUT and SETUP

Outcome UsbHost::handshake()
{
    const PacketError error = check_handshake(packet_);
    if (error != PacketError::NONE) {
        return irregular(error, false);
    }
    if (packet_[0] == PID_NAK) {
        counters_.naks++;
        return Outcome::NAK;
    }
    if (packet_[0] == PID_STALL) {
        counters_.stalls++;
        return Outcome::STALL;
    }
    return Outcome::OK;
}

// LUNA waits for the data of a damaged SETUP until the next token and uses that token up (USBSetupDecoder, READ_DATA),
// so the first retry goes unanswered too; the third of the three attempts a host makes gets through.
Outcome UsbHost::silence(Pid pid)
{
    return irregular(PacketError::EMPTY, pid == PID_SETUP && setup_may_be_lost_);
}

Outcome UsbHost::out_once(Pid pid, uint8_t endpoint, const Bytes &packet)
{
    counters_.transactions++;
    send_token(pid, endpoint, false);
    idle(PACKET_GAP);
    send(packet);
    const Outcome outcome = receive(sizeof(uint64_t)) ? handshake() : silence(pid);
    setup_may_be_lost_ = false;
    idle(PACKET_GAP);
    return outcome;
}

Outcome UsbHost::out_retried(Pid pid, uint8_t endpoint, const Bytes &packet)
{
    Outcome outcome = Outcome::TIMEOUT;
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        outcome = out_once(pid, endpoint, packet);
        if (final_outcome(outcome)) {
            break;
        }
    }
    return outcome;
}

Outcome UsbHost::out(uint8_t endpoint, const uint8_t *data, size_t count)
{
    const Outcome outcome = out_retried(PID_OUT, endpoint, data_packet(toggle_out_[endpoint], data, count));
    if (outcome == Outcome::OK) {
        toggle_out_[endpoint] = !toggle_out_[endpoint];
    }
    return outcome;
}

Outcome UsbHost::setup(const uint8_t request[8])
{
    const Bytes packet = data_packet(false, request, 8);
    if (use(WireFault::BAD_SETUP)) {
        spoiled_setup(packet);
    }
    const Outcome outcome = out_retried(PID_SETUP, 0, packet);
    toggle_in_[0] = true;
    toggle_out_[0] = true;
    return outcome;
}

// ---------------------------------------------------------------------------------------------------------- toggles

void UsbHost::set_address(uint8_t address)
{
    address_ = address;
}

void UsbHost::clear_toggles()
{
    for (size_t endpoint = 1; endpoint < toggle_in_.size(); endpoint++) {
        toggle_in_[endpoint] = false;
        toggle_out_[endpoint] = false;
    }
}

void UsbHost::clear_toggle(uint8_t endpoint, bool in)
{
    (in ? toggle_in_ : toggle_out_)[endpoint] = false;
}

void UsbHost::set_toggle(uint8_t endpoint, bool in, bool value)
{
    (in ? toggle_in_ : toggle_out_)[endpoint] = value;
}

} // namespace bridge_sim
