#include "usb_host.h"

namespace bridge_sim
{

namespace
{

// A host controller gives a transaction up after three errors in a row.
constexpr int ATTEMPTS = 3;

bool final_outcome(Outcome outcome)
{
    return outcome == Outcome::OK || outcome == Outcome::NAK || outcome == Outcome::STALL;
}

} // namespace

UsbHost::UsbHost(UtmiDevice &device) : bus_(device)
{
}

const HostCounters &UsbHost::counters() const
{
    return counters_;
}

UsbBus &UsbHost::bus()
{
    return bus_;
}

uint8_t UsbHost::address() const
{
    return address_;
}

bool UsbHost::reset(BusSpeed speed)
{
    address_ = 0;
    toggle_in_.fill(false);
    toggle_out_.fill(false);
    copy_due_.fill(false);
    return bus_.reset(speed);
}

// Whatever a device says while nobody asked is out of place.
void UsbHost::idle(uint64_t cycles)
{
    bus_.idle(cycles);
    if (bus_.take_unasked()) {
        violation();
    }
}

void UsbHost::violation()
{
    counters_.violations++;
    counters_.unexplained++;
}

void UsbHost::send_token(Pid pid, uint8_t endpoint, bool spoil)
{
    Bytes token = token_packet(pid, static_cast<uint16_t>(address_ | endpoint << 7));
    if (spoil) {
        token[2] ^= 0x80u; // one bit of the CRC-5
    }
    bus_.send(token);
}

void UsbHost::start_of_frame()
{
    bus_.send(token_packet(PID_SOF, static_cast<uint16_t>((microframe_++ >> 3) & 0x7FFu)));
    idle(PACKET_GAP);
}

uint16_t UsbHost::microframe() const
{
    return microframe_;
}

void UsbHost::set_microframe(uint64_t microframe)
{
    microframe_ = static_cast<uint16_t>(microframe);
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
    if (bus_.receive(sizeof(uint64_t), packet_)) {
        violation();
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
    bus_.send(spoiled);
    expect_silence();
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
    if (!bus_.receive(limit, packet_)) {
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
        bus_.idle(HANDSHAKE_GAP);
        bus_.send({PID_ACK});
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

Outcome UsbHost::out_once(Pid pid, uint8_t endpoint, const Bytes &packet)
{
    counters_.transactions++;
    send_token(pid, endpoint, false);
    idle(PACKET_GAP);
    bus_.send(packet);
    const Outcome outcome =
        bus_.receive(sizeof(uint64_t), packet_) ? handshake() : irregular(PacketError::EMPTY, false);
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
    if (outcome == Outcome::NAK || outcome == Outcome::STALL) {
        violation(); // a device has to take every SETUP (USB 2.0, 8.4.6.4)
    }
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
