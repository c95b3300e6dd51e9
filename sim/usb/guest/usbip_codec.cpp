#include "usbip_codec.h"

#include <cstring>
#include <stdexcept>

#include "usb_layout.h"

namespace bridge_sim
{

namespace
{

// Operations: before a device is imported.
constexpr uint16_t REQUEST_LIST = 0x8005;
constexpr uint16_t REQUEST_IMPORT = 0x8003;
constexpr uint16_t ANSWER_LIST = 0x0005;
constexpr uint16_t ANSWER_IMPORT = 0x0003;
constexpr size_t OPERATION_BYTES = 8;
constexpr size_t PATH_BYTES = 256;
constexpr size_t BUS_ID_BYTES = 32;
constexpr char PATH[] = "/sys/devices/simulated/usb1/1-1";

// Commands: after it.
constexpr uint32_t COMMAND_SUBMIT = 1;
constexpr uint32_t COMMAND_UNLINK = 2;
constexpr uint32_t ANSWER_SUBMIT = 3;
constexpr uint32_t ANSWER_UNLINK = 4;
constexpr size_t COMMAND_BYTES = 48;
constexpr uint32_t TO_HOST = 1;
constexpr uint32_t ENDPOINT_LAST = 15;
// Number of packets of a transfer that is not isochronous: the one, or, from older kernels, the other.
constexpr uint32_t NOT_ISOCHRONOUS = UINT32_MAX;
constexpr uint32_t SPEED_FULL = 2, SPEED_HIGH = 3;

uint32_t get_u32(const Bytes &bytes, size_t at)
{
    return static_cast<uint32_t>(bytes[at]) << 24 | static_cast<uint32_t>(bytes[at + 1]) << 16 |
           static_cast<uint32_t>(bytes[at + 2]) << 8 | bytes[at + 3];
}

uint16_t get_u16(const Bytes &bytes, size_t at)
{
    return static_cast<uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

void put_u16(Bytes &bytes, uint16_t value)
{
    bytes.push_back(static_cast<uint8_t>(value >> 8));
    bytes.push_back(static_cast<uint8_t>(value));
}

void put_u32(Bytes &bytes, uint32_t value)
{
    put_u16(bytes, static_cast<uint16_t>(value >> 16));
    put_u16(bytes, static_cast<uint16_t>(value));
}

void put_text(Bytes &bytes, const char *text, size_t size)
{
    const size_t length = std::strlen(text);
    bytes.insert(bytes.end(), text, text + length);
    bytes.resize(bytes.size() + size - length);
}

[[noreturn]] void refuse(const std::string &what)
{
    throw std::runtime_error("USB/IP: " + what);
}

Bytes operation(uint16_t code, UsbipStatus status)
{
    Bytes bytes;
    put_u16(bytes, USBIP_VERSION);
    put_u16(bytes, code);
    put_u32(bytes, static_cast<uint32_t>(status));
    return bytes;
}

void put_device(Bytes &bytes, const Descriptors &descriptors)
{
    const UsbLayout layout = UsbLayout::parse(descriptors);
    put_text(bytes, PATH, PATH_BYTES);
    put_text(bytes, USBIP_BUS_ID, BUS_ID_BYTES);
    put_u32(bytes, USBIP_DEVICE_ID >> 16);
    put_u32(bytes, USBIP_DEVICE_ID & UINT16_MAX);
    put_u32(bytes, descriptors.high_speed() ? SPEED_HIGH : SPEED_FULL);
    put_u16(bytes, layout.vendor);
    put_u16(bytes, layout.product);
    put_u16(bytes, layout.release);
    for (const unsigned value : {unsigned{layout.device_class}, unsigned{layout.device_subclass},
                                 unsigned{layout.device_protocol}, 1u, 1u, unsigned(layout.interfaces.size())}) {
        bytes.push_back(static_cast<uint8_t>(value)); // then configuration in force, configurations, interfaces
    }
}

Bytes answer(uint32_t command, uint32_t sequence, int status)
{
    Bytes bytes;
    put_u32(bytes, command);
    put_u32(bytes, sequence);
    bytes.resize(bytes.size() + 12); // device, direction, endpoint: zero in answers
    put_u32(bytes, static_cast<uint32_t>(status));
    return bytes;
}

// The fields of a SUBMIT but for its data.
UsbipMessage parse_submit(const Bytes &bytes)
{
    UsbipMessage message;
    message.kind = UsbipMessage::Kind::SUBMIT;
    message.to_host = get_u32(bytes, 12) == TO_HOST;
    const uint32_t endpoint = get_u32(bytes, 16);
    const uint32_t packets = get_u32(bytes, 32);
    message.length = get_u32(bytes, 24);
    if (endpoint > ENDPOINT_LAST) {
        refuse("endpoint " + std::to_string(endpoint) + " in a transfer");
    }
    if (message.length > USBIP_TRANSFER_MAX) {
        refuse("a transfer of " + std::to_string(message.length) + " bytes; at most " +
               std::to_string(USBIP_TRANSFER_MAX) + " are taken");
    }
    if (packets != 0 && packets != NOT_ISOCHRONOUS) {
        refuse("an isochronous transfer, for which the bridge has no endpoint");
    }
    message.endpoint = static_cast<uint8_t>(endpoint);
    message.setup = SetupRequest::parse(bytes.data() + 40);
    return message;
}

} // namespace

// ------------------------------------------------------------------------------------------------------------ decoding

void UsbipDecoder::feed(const uint8_t *bytes, size_t count)
{
    waiting_.insert(waiting_.end(), bytes, bytes + count);
}

std::optional<UsbipMessage> UsbipDecoder::next()
{
    return imported_ ? next_command() : next_operation();
}

UsbipMessage UsbipDecoder::take(UsbipMessage message, size_t count)
{
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<Bytes::difference_type>(count));
    return message;
}

std::optional<UsbipMessage> UsbipDecoder::next_operation()
{
    if (waiting_.size() < OPERATION_BYTES) {
        return std::nullopt;
    }
    if (get_u16(waiting_, 0) != USBIP_VERSION) {
        refuse("the client speaks another version of the protocol");
    }
    UsbipMessage message;
    switch (get_u16(waiting_, 2)) {
    case REQUEST_LIST:
        return take(message, OPERATION_BYTES);
    case REQUEST_IMPORT:
        if (waiting_.size() < OPERATION_BYTES + BUS_ID_BYTES) {
            return std::nullopt;
        }
        message.kind = UsbipMessage::Kind::IMPORT;
        message.bus_id.assign(waiting_.begin() + OPERATION_BYTES, waiting_.begin() + OPERATION_BYTES + BUS_ID_BYTES);
        message.bus_id.resize(std::strlen(message.bus_id.c_str()));
        imported_ = true;
        return take(message, OPERATION_BYTES + BUS_ID_BYTES);
    default:
        refuse("unknown request");
    }
}

std::optional<UsbipMessage> UsbipDecoder::next_command()
{
    if (waiting_.size() < COMMAND_BYTES) {
        return std::nullopt;
    }
    UsbipMessage message;
    size_t size = COMMAND_BYTES;
    switch (get_u32(waiting_, 0)) {
    case COMMAND_SUBMIT:
        message = parse_submit(waiting_);
        size += message.to_host ? 0 : message.length;
        break;
    case COMMAND_UNLINK:
        message.kind = UsbipMessage::Kind::UNLINK;
        message.unlinked = get_u32(waiting_, 20);
        break;
    default:
        refuse("unknown command");
    }
    if (waiting_.size() < size) {
        return std::nullopt;
    }
    message.sequence = get_u32(waiting_, 4);
    message.data.assign(waiting_.begin() + COMMAND_BYTES, waiting_.begin() + static_cast<Bytes::difference_type>(size));
    return take(std::move(message), size);
}

// ------------------------------------------------------------------------------------------------------------- answers

Bytes usbip_list_answer(const Descriptors *descriptors)
{
    Bytes bytes = operation(ANSWER_LIST, UsbipStatus::OK);
    put_u32(bytes, descriptors ? 1 : 0);
    if (descriptors) {
        put_device(bytes, *descriptors);
        for (const UsbInterface &interface : UsbLayout::parse(*descriptors).interfaces) {
            const uint8_t entry[] = {interface.interface_class, interface.subclass, interface.protocol, 0};
            bytes.insert(bytes.end(), std::begin(entry), std::end(entry));
        }
    }
    return bytes;
}

Bytes usbip_import_answer(UsbipStatus status, const Descriptors &descriptors)
{
    Bytes bytes = operation(ANSWER_IMPORT, status);
    if (status == UsbipStatus::OK) {
        put_device(bytes, descriptors);
    }
    return bytes;
}

Bytes usbip_submit_answer(uint32_t sequence, int status, uint32_t actual, const Bytes &data)
{
    Bytes bytes = answer(ANSWER_SUBMIT, sequence, status);
    put_u32(bytes, actual);
    bytes.resize(COMMAND_BYTES);
    bytes.insert(bytes.end(), data.begin(), data.end());
    return bytes;
}

Bytes usbip_unlink_answer(uint32_t sequence, int status)
{
    Bytes bytes = answer(ANSWER_UNLINK, sequence, status);
    bytes.resize(COMMAND_BYTES);
    return bytes;
}

} // namespace bridge_sim
