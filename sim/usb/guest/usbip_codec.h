// The bytes of USB/IP 1.1.1 (Documentation/usb/usbip_protocol in the Linux kernel): what a client sends, decoded piece
// by piece as it comes, and the server's answers. All numbers big-endian. No sockets, no device. It is our own code: no
// maintained library of a permissive licence serves USB/IP without a kernel module.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "usb_control.h"

namespace bridge_sim
{

constexpr uint16_t USBIP_VERSION = 0x0111;
constexpr uint16_t USBIP_PORT = 3240;
constexpr char USBIP_BUS_ID[] = "1-1";
constexpr uint32_t USBIP_DEVICE_ID = 1u << 16 | 2u; // bus 1, device 2
constexpr size_t USBIP_TRANSFER_MAX = 1u << 20;     // bytes of one transfer

// Status of an answer to a list or import request.
enum class UsbipStatus : uint32_t { OK = 0, BUSY = 2, NO_DEVICE = 4 };

struct UsbipMessage {
    enum class Kind { LIST, IMPORT, SUBMIT, UNLINK };
    Kind kind = Kind::LIST;
    std::string bus_id;    // IMPORT
    uint32_t sequence = 0; // SUBMIT, UNLINK
    uint32_t unlinked = 0; // UNLINK: the sequence number of the transfer to end
    uint8_t endpoint = 0;  // SUBMIT: number without direction
    bool to_host = false;  // SUBMIT
    uint32_t length = 0;   // SUBMIT: bytes of the transfer
    SetupRequest setup;    // SUBMIT on endpoint 0
    Bytes data;            // SUBMIT to the device
};

class UsbipDecoder
{
  public:
    // Bytes of the connection, in any pieces.
    void feed(const uint8_t *bytes, size_t count);

    // The next whole message, if there is one. Throws std::runtime_error with one line when the bytes are no USB/IP of
    // this version, or ask for what this device does not have; the connection then makes no sense any more.
    std::optional<UsbipMessage> next();

  private:
    std::optional<UsbipMessage> next_operation();
    std::optional<UsbipMessage> next_command();
    UsbipMessage take(UsbipMessage message, size_t count);

    Bytes waiting_;
    bool imported_ = false; // an import request has passed: commands follow
};

// Answer to LIST; no descriptors: no device.
Bytes usbip_list_answer(const Descriptors *descriptors);

// Answer to IMPORT; the descriptors are sent with UsbipStatus::OK only.
Bytes usbip_import_answer(UsbipStatus status, const Descriptors &descriptors);

// Answer to SUBMIT: `status` 0 or a negative errno, `actual` bytes transferred; data only for transfers to the host.
Bytes usbip_submit_answer(uint32_t sequence, int status, uint32_t actual, const Bytes &data);

// Answer to UNLINK: -ECONNRESET if the transfer was ended by it, 0 if it had ended before.
Bytes usbip_unlink_answer(uint32_t sequence, int status);

} // namespace bridge_sim
