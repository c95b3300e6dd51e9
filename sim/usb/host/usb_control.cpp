#include "usb_control.h"

namespace bridge_sim
{

namespace
{

constexpr size_t CONTROL_PACKET = 64;
constexpr uint8_t TO_HOST = 0x80;
constexpr uint8_t TO_INTERFACE = 0x01;
constexpr uint8_t TO_ENDPOINT = 0x02;
constexpr uint8_t CLEAR_FEATURE = 1;
constexpr uint8_t SET_ADDRESS = 5;
constexpr uint8_t GET_DESCRIPTOR = 6;
constexpr uint8_t SET_CONFIGURATION = 9;
constexpr uint8_t SET_INTERFACE = 11;
constexpr uint16_t DEVICE_DESCRIPTOR = 0x0100;
constexpr uint16_t CONFIGURATION_DESCRIPTOR = 0x0200;
constexpr uint8_t ADDRESS = 1;
// NAKs a stage may give before the transfer counts as timed out: some 5 ms of bus time.
constexpr int STAGE_PATIENCE = 5000;

Outcome in_patiently(UsbHost &host, Bytes &packet)
{
    Outcome outcome = Outcome::NAK;
    for (int i = 0; i < STAGE_PATIENCE && outcome == Outcome::NAK; i++) {
        outcome = host.in(0, CONTROL_PACKET, packet);
    }
    return outcome == Outcome::NAK ? Outcome::TIMEOUT : outcome;
}

Outcome out_patiently(UsbHost &host, const uint8_t *data, size_t count)
{
    Outcome outcome = Outcome::NAK;
    for (int i = 0; i < STAGE_PATIENCE && outcome == Outcome::NAK; i++) {
        outcome = host.out(0, data, count);
    }
    return outcome == Outcome::NAK ? Outcome::TIMEOUT : outcome;
}

Outcome data_in(UsbHost &host, size_t length, Bytes &data)
{
    data.clear();
    Bytes packet;
    do {
        const Outcome outcome = in_patiently(host, packet);
        if (outcome != Outcome::OK) {
            return outcome;
        }
        data.insert(data.end(), packet.begin(), packet.end());
    } while (packet.size() == CONTROL_PACKET && data.size() < length);
    return data.size() <= length ? Outcome::OK : Outcome::BABBLE;
}

Outcome data_out(UsbHost &host, size_t length, const Bytes &data)
{
    for (size_t at = 0; at < length; at += CONTROL_PACKET) {
        const size_t rest = length - at;
        const Outcome outcome = out_patiently(host, data.data() + at, rest < CONTROL_PACKET ? rest : CONTROL_PACKET);
        if (outcome != Outcome::OK) {
            return outcome;
        }
    }
    return Outcome::OK;
}

Outcome status_in(UsbHost &host)
{
    Bytes packet;
    host.set_toggle(0, true, true);
    const Outcome outcome = in_patiently(host, packet);
    return outcome == Outcome::OK && !packet.empty() ? Outcome::BABBLE : outcome;
}

Outcome status_out(UsbHost &host)
{
    host.set_toggle(0, false, true);
    return out_patiently(host, nullptr, 0);
}

void follow(UsbHost &host, const SetupRequest &request)
{
    if (request.type == 0 && request.request == SET_ADDRESS) {
        host.set_address(static_cast<uint8_t>(request.value & 0x7Fu));
    } else if (request.type == 0 && request.request == SET_CONFIGURATION) {
        host.clear_toggles();
    } else if (request.type == TO_INTERFACE && request.request == SET_INTERFACE) {
        host.clear_toggle(static_cast<uint8_t>(request.index + 1), true); // interface n has IN endpoint n + 1
    } else if (request.type == TO_ENDPOINT && request.request == CLEAR_FEATURE) {
        host.clear_toggle(request.index & 0xFu, (request.index & TO_HOST) != 0);
    }
}

Outcome get_descriptor(const ControlTransfer &transfer, uint16_t which, uint16_t length, Bytes &data)
{
    return transfer({TO_HOST, GET_DESCRIPTOR, which, 0, length}, data);
}

bool read_configuration(const ControlTransfer &transfer, Bytes &configuration)
{
    constexpr uint16_t HEADER = 9;
    if (get_descriptor(transfer, CONFIGURATION_DESCRIPTOR, HEADER, configuration) != Outcome::OK ||
        configuration.size() != HEADER) {
        return false;
    }
    const auto total = static_cast<uint16_t>(configuration[2] | configuration[3] << 8);
    return get_descriptor(transfer, CONFIGURATION_DESCRIPTOR, total, configuration) == Outcome::OK &&
           configuration.size() == total;
}

} // namespace

SetupRequest SetupRequest::parse(const uint8_t bytes[8])
{
    const auto word = [bytes](int at) { return static_cast<uint16_t>(bytes[at] | bytes[at + 1] << 8); };
    return {bytes[0], bytes[1], word(2), word(4), word(6)};
}

bool SetupRequest::to_host() const
{
    return (type & TO_HOST) != 0;
}

Outcome control_transfer(UsbHost &host, const SetupRequest &request, Bytes &data)
{
    const auto low = [](uint16_t word) { return static_cast<uint8_t>(word & 0xFFu); };
    const auto high = [](uint16_t word) { return static_cast<uint8_t>(word >> 8); };
    const uint8_t bytes[8] = {request.type,       request.request,     low(request.value),  high(request.value),
                              low(request.index), high(request.index), low(request.length), high(request.length)};
    Outcome outcome = host.setup(bytes);
    const bool reads = request.to_host() && request.length > 0;
    if (outcome == Outcome::OK && request.length > 0) {
        outcome = reads ? data_in(host, request.length, data) : data_out(host, request.length, data);
    }
    if (outcome == Outcome::OK) {
        outcome = reads ? status_out(host) : status_in(host);
    }
    if (outcome == Outcome::OK) {
        follow(host, request);
    }
    return outcome;
}

bool Descriptors::high_speed() const
{
    constexpr uint8_t ENDPOINT = 5;
    constexpr size_t PACKET_HIGH = 5; // of its descriptor: the packet size's high byte; 512 only at high speed
    for (size_t at = 0; at + PACKET_HIGH < configuration.size() && configuration[at] > 0; at += configuration[at]) {
        if (configuration[at + 1] == ENDPOINT && configuration[at + PACKET_HIGH] >= 2) {
            return true;
        }
    }
    return false;
}

Bytes Descriptors::all() const
{
    Bytes bytes = device;
    bytes.insert(bytes.end(), configuration.begin(), configuration.end());
    return bytes;
}

bool enumerate(UsbHost &host, Descriptors &descriptors, const char *&error)
{
    error = "no high-speed chirp";
    const auto transfer = [&host](const SetupRequest &request, Bytes &data) {
        return control_transfer(host, request, data);
    };
    return host.reset() && configure(transfer, descriptors, error);
}

bool configure(const ControlTransfer &transfer, Descriptors &descriptors, const char *&error)
{
    constexpr uint16_t DEVICE_BYTES = 18;
    Bytes none;
    error = "SET_ADDRESS failed";
    if (transfer({0, SET_ADDRESS, ADDRESS, 0, 0}, none) != Outcome::OK) {
        return false;
    }
    error = "device descriptor unreadable";
    if (get_descriptor(transfer, DEVICE_DESCRIPTOR, DEVICE_BYTES, descriptors.device) != Outcome::OK) {
        return false;
    }
    error = "configuration descriptor unreadable";
    if (!read_configuration(transfer, descriptors.configuration)) {
        return false;
    }
    error = "SET_CONFIGURATION failed";
    return transfer({0, SET_CONFIGURATION, 1, 0, 0}, none) == Outcome::OK;
}

} // namespace bridge_sim
