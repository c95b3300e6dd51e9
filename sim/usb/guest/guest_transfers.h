// The transfers of one client of the server: which are in the model, and which of them a result belongs to. The client
// names them by its sequence numbers; the model knows them by ids that no two clients share.
#pragma once

#include <map>
#include <optional>

#include "device_port.h"
#include "usb_layout.h"

namespace bridge_sim
{

// More at a time are no sensible host's.
constexpr size_t GUEST_TRANSFERS_MAX = 1024;

// What a client asks to be transferred.
struct GuestTransfer {
    uint8_t address = 0; // endpoint, bit 7: to the host
    SetupRequest setup;  // endpoint 0 only
    size_t length = 0;   // bytes
    Bytes data;          // to the device
};

class GuestTransfers
{
  public:
    // The device as the client sees it from now on.
    void set_device(const UsbLayout &layout);

    // Hands a transfer to the model. Returns 0, or a negative errno if it cannot be: no such endpoint (-EPIPE), length
    // and SETUP packet disagree (-EINVAL), too many at a time (-ENOMEM).
    int submit(uint64_t name, GuestTransfer transfer);

    // A bus reset with what follows it; ends as a transfer does.
    void bus_reset(uint64_t name);

    // Asks for a transfer to be ended; it then ends with -ENOENT and what it had received. False: it is not under way.
    bool discard(uint64_t name);

    // The client is gone: its transfers are ended, and nobody hears of them.
    void forget_all();

    // The name of a transfer that the model has ended; none: it is nobody's any more.
    std::optional<uint64_t> ended(const Urb &urb);

    std::vector<DeviceRequest> take_requests();

  private:
    void post(uint64_t name, Urb urb);

    UsbLayout layout_;
    std::map<uint64_t, uint64_t> names_; // by the model's id
    std::vector<DeviceRequest> requests_;
    uint64_t next_id_ = 1;
};

// Bytes that an ended transfer moved, in whichever direction.
size_t transferred(const Urb &urb);

// What the host gets of them: nothing for a transfer to the device.
Bytes received(const Urb &urb);

} // namespace bridge_sim
