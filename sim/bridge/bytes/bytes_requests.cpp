// Level bytes: which control requests the device serves, and what each changes.
#include <algorithm>

#include "bytes_descriptors.h"
#include "bytes_device.h"

namespace bridge_sim
{

namespace
{

// bmRequestType, USB 2.0 table 9-2.
constexpr uint8_t RECIPIENT = 0x1F, TYPE = 0x60, STANDARD = 0x00, CLASS = 0x20, VENDOR = 0x40;
constexpr uint8_t DEVICE = 0, INTERFACE = 1, ENDPOINT = 2;
// bRequest, table 9-4, and of HID 1.11 section 7.2.
constexpr uint8_t GET_STATUS = 0, CLEAR_FEATURE = 1, SET_FEATURE = 3, SET_ADDRESS = 5, GET_DESCRIPTOR = 6;
constexpr uint8_t GET_CONFIGURATION = 8, SET_CONFIGURATION = 9, GET_INTERFACE = 10, SET_INTERFACE = 11;
constexpr uint8_t GET_REPORT = 0x01, GET_IDLE = 0x02, SET_REPORT = 0x09, SET_IDLE = 0x0A;
constexpr uint8_t FEATURE_REPORT = 3;
constexpr uint16_t ENDPOINT_HALT = 0;
constexpr uint16_t ADDRESSES = 128;
constexpr uint16_t INTERFACES = 2;
// Descriptors that the device as a whole has, and its HID interface; table 9-5, HID 1.11 section 7.1. The Windows set
// lies under a type that nobody can ask for (standard_requests.py).
constexpr std::array<uint8_t, 6> OF_DEVICE = {1, 2, 3, 6, 7, 15};
constexpr std::array<uint8_t, 2> OF_INTERFACE = {0x21, 0x22};
constexpr uint8_t CONFIGURATION = 2, SELF_POWERED = 0x40;
constexpr size_t ATTRIBUTES = 7; // place in a configuration descriptor
constexpr uint8_t WINDOWS_SET = 10, WINDOWS_REQUEST = 0x20;
constexpr uint16_t WINDOWS_INDEX = 7;

uint8_t high(uint16_t word)
{
    return static_cast<uint8_t>(word >> 8);
}

uint8_t low(uint16_t word)
{
    return static_cast<uint8_t>(word & 0xFFu);
}

uint8_t recipient(const SetupRequest &request)
{
    return request.type & RECIPIENT;
}

bool plain(const SetupRequest &request)
{
    return !request.to_host() && request.length == 0;
}

bool reads(const SetupRequest &request)
{
    return request.to_host() && request.length != 0;
}

bool no_index(const SetupRequest &request)
{
    return recipient(request) == DEVICE && request.index == 0;
}

Outcome answer(const SetupRequest &request, Bytes &data, Bytes all)
{
    all.resize(std::min<size_t>(all.size(), request.length));
    data = std::move(all);
    return Outcome::OK;
}

Outcome descriptor(const SetupRequest &request, Bytes &data, uint8_t type, uint8_t index)
{
    const auto found = std::find_if(DESCRIPTORS.begin(), DESCRIPTORS.end(),
                                    [=](const Descriptor &d) { return d.type == type && d.index == index; });
    if (request.length == 0) {
        return Outcome::OK; // nothing is looked up for it
    }
    return found == DESCRIPTORS.end() ? Outcome::STALL : answer(request, data, found->bytes);
}

// As the configuration descriptor says (USB 2.0 table 9-10).
bool self_powered()
{
    const auto found = std::find_if(DESCRIPTORS.begin(), DESCRIPTORS.end(),
                                    [](const Descriptor &d) { return d.type == CONFIGURATION; });
    return found->bytes[ATTRIBUTES] & SELF_POWERED;
}

Outcome get_descriptor(const SetupRequest &request, Bytes &data)
{
    const auto one_of = [type = high(request.value)](const auto &types) {
        return std::find(types.begin(), types.end(), type) != types.end();
    };
    const bool of_device = recipient(request) == DEVICE && one_of(OF_DEVICE);
    const bool of_interface =
        recipient(request) == INTERFACE && request.index == WHISKER_LIMIT_USB_HID_INTERFACE && one_of(OF_INTERFACE);
    if (!request.to_host() || !(of_device || of_interface)) {
        return Outcome::STALL;
    }
    return descriptor(request, data, high(request.value), low(request.value));
}

Outcome serve_vendor(const SetupRequest &request, Bytes &data)
{
    const bool windows = recipient(request) == DEVICE && request.to_host() && request.index == WINDOWS_INDEX &&
                         request.value == 0 && request.request == WINDOWS_REQUEST;
    return windows ? descriptor(request, data, WINDOWS_SET, 0) : Outcome::STALL;
}

} // namespace

Outcome BytesDevice::serve(const SetupRequest &request, Bytes &data)
{
    switch (request.type & TYPE) {
    case STANDARD:
        return serve_standard(request, data);
    case CLASS:
        return serve_class(request, data);
    case VENDOR:
        return serve_vendor(request, data);
    default:
        return Outcome::STALL;
    }
}

Outcome BytesDevice::serve_standard(const SetupRequest &request, Bytes &data)
{
    switch (request.request) {
    case GET_STATUS:
        return status(request, data);
    case CLEAR_FEATURE:
    case SET_FEATURE:
        return serve_feature(request);
    case SET_ADDRESS:
        if (!plain(request) || !no_index(request) || request.value >= ADDRESSES || configuration_ != 0) {
            return Outcome::STALL;
        }
        address_ = low(request.value);
        return Outcome::OK;
    case GET_DESCRIPTOR:
        return get_descriptor(request, data);
    case GET_CONFIGURATION:
        return reads(request) && no_index(request) && request.value == 0 ? answer(request, data, {configuration_})
                                                                         : Outcome::STALL;
    case SET_CONFIGURATION:
        return set_configuration(request);
    case GET_INTERFACE:
        return reads(request) && interface_known(request) && request.value == 0 ? answer(request, data, {0})
                                                                                : Outcome::STALL;
    case SET_INTERFACE:
        return set_interface(request);
    default:
        return Outcome::STALL;
    }
}

bool BytesDevice::interface_known(const SetupRequest &request) const
{
    return recipient(request) == INTERFACE && configuration_ != 0 && request.index < INTERFACES;
}

bool BytesDevice::endpoint_known(const SetupRequest &request) const
{
    const bool of_control = (request.index & 0xFF7Fu) == 0; // either direction
    const bool chosen = std::find(ADDRESS_OF.begin(), ADDRESS_OF.end(), request.index) != ADDRESS_OF.end();
    return recipient(request) == ENDPOINT && (of_control || (configuration_ != 0 && chosen));
}

Outcome BytesDevice::status(const SetupRequest &request, Bytes &data) const
{
    if (!reads(request) || request.value != 0 ||
        !(no_index(request) || interface_known(request) || endpoint_known(request))) {
        return Outcome::STALL;
    }
    uint8_t halted = 0;
    for (size_t i = 0; i < ENDPOINTS; i++) {
        halted |= recipient(request) == ENDPOINT && request.index == ADDRESS_OF[i] && halted_[i];
    }
    const uint8_t self = recipient(request) == DEVICE && self_powered();
    return answer(request, data, {static_cast<uint8_t>(halted | self), 0});
}

Outcome BytesDevice::serve_feature(const SetupRequest &request)
{
    if (!plain(request) || !endpoint_known(request) || request.value != ENDPOINT_HALT) {
        return Outcome::STALL;
    }
    for (size_t i = 0; i < ENDPOINTS; i++) {
        if (request.index == ADDRESS_OF[i]) {
            set_halt(i, request.request == SET_FEATURE);
        }
    }
    return Outcome::OK;
}

// A packet whose ACK was lost comes again after the halt, and no host can tell it from a new one.
void BytesDevice::set_halt(size_t endpoint, bool halted)
{
    halted_[endpoint] = halted;
    ack_lost_ = ack_lost_ && (halted || endpoint != BULK);
}

Outcome BytesDevice::set_configuration(const SetupRequest &request)
{
    if (!plain(request) || !no_index(request) || request.value > 1 || address_ == 0) {
        return Outcome::STALL;
    }
    configuration_ = low(request.value);
    restart();
    return Outcome::OK;
}

Outcome BytesDevice::set_interface(const SetupRequest &request)
{
    if (!plain(request) || !interface_known(request) || request.value != 0) {
        return Outcome::STALL;
    }
    set_halt(request.index, false);
    return Outcome::OK;
}

Outcome BytesDevice::serve_class(const SetupRequest &request, Bytes &data)
{
    if (recipient(request) != INTERFACE || request.index != WHISKER_LIMIT_USB_HID_INTERFACE || configuration_ == 0) {
        return Outcome::STALL;
    }
    if (request.request == GET_IDLE && reads(request)) {
        return answer(request, data, {idle_});
    }
    if (request.request == SET_IDLE && plain(request)) {
        idle_ = high(request.value);
        return Outcome::OK;
    }
    return high(request.value) == FEATURE_REPORT ? serve_report(request, data) : Outcome::STALL;
}

Outcome BytesDevice::serve_report(const SetupRequest &request, Bytes &data)
{
    const uint8_t id = low(request.value);
    if (request.request == GET_REPORT && reads(request)) {
        const Bytes report = bridge_.get_report(id);
        return report.empty() ? Outcome::STALL : answer(request, data, report);
    }
    const bool known = (id == WHISKER_REPORT_ID_CONTROL && request.length == WHISKER_REPORT_CONTROL_BYTES) ||
                       (id == WHISKER_REPORT_ID_SERVICE && request.length == WHISKER_REPORT_SERVICE_BYTES) ||
                       (id == WHISKER_REPORT_ID_FLASH && request.length == WHISKER_REPORT_FLASH_BYTES);
    if (request.request != SET_REPORT || request.to_host() || !known) {
        return Outcome::STALL;
    }
    use(WireFault::BAD_TOKEN); // accepted or refused at the status stage, an IN
    return bridge_.set_report({data.begin(), data.begin() + request.length}) ? Outcome::OK : Outcome::STALL;
}

} // namespace bridge_sim
