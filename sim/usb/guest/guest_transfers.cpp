#include "guest_transfers.h"

#include <algorithm>
#include <cerrno>

namespace bridge_sim
{

namespace
{

constexpr uint8_t TO_HOST = 0x80;
constexpr uint8_t BULK = 2; // endpoint types, USB 2.0 table 9-13
constexpr uint8_t INTERRUPT = 3;

std::optional<UrbKind> kind_of(const UsbEndpoint *endpoint)
{
    if (!endpoint || (endpoint->address & TO_HOST) == 0) {
        return std::nullopt;
    }
    return endpoint->type == BULK        ? std::optional(UrbKind::BULK_IN)
           : endpoint->type == INTERRUPT ? std::optional(UrbKind::INTERRUPT_IN)
                                         : std::nullopt;
}

// What the device will send, or wants, must fit into what the client has room for, or has sent.
bool setup_fits(const GuestTransfer &transfer)
{
    const size_t available = transfer.setup.to_host() ? transfer.length : transfer.data.size();
    return transfer.setup.length <= available;
}

} // namespace

void GuestTransfers::set_device(const UsbLayout &layout)
{
    layout_ = layout;
}

int GuestTransfers::submit(uint64_t name, GuestTransfer transfer)
{
    Urb urb;
    urb.length = transfer.length;
    if (names_.size() >= GUEST_TRANSFERS_MAX) {
        return -ENOMEM;
    }
    if ((transfer.address & ~TO_HOST) == 0) {
        if (!setup_fits(transfer)) {
            return -EINVAL;
        }
        urb.setup = transfer.setup;
        urb.data = std::move(transfer.data);
    } else if (const auto kind = kind_of(layout_.endpoint(transfer.address))) {
        urb.kind = *kind;
    } else {
        return -EPIPE;
    }
    post(name, std::move(urb));
    return 0;
}

void GuestTransfers::bus_reset(uint64_t name)
{
    Urb urb;
    urb.kind = UrbKind::BUS_RESET;
    post(name, std::move(urb));
}

void GuestTransfers::post(uint64_t name, Urb urb)
{
    urb.id = next_id_++;
    names_[urb.id] = name;
    requests_.push_back({false, std::move(urb)});
}

bool GuestTransfers::discard(uint64_t name)
{
    const auto at = std::find_if(names_.begin(), names_.end(), [name](const auto &one) { return one.second == name; });
    if (at != names_.end()) {
        Urb urb;
        urb.id = at->first;
        requests_.push_back({true, std::move(urb)});
    }
    return at != names_.end();
}

void GuestTransfers::forget_all()
{
    for (const auto &[id, name] : names_) {
        Urb urb;
        urb.id = id;
        requests_.push_back({true, std::move(urb)});
    }
    names_.clear();
}

std::optional<uint64_t> GuestTransfers::ended(const Urb &urb)
{
    const auto at = names_.find(urb.id);
    if (at == names_.end()) {
        return std::nullopt;
    }
    const uint64_t name = at->second;
    names_.erase(at);
    return name;
}

std::vector<DeviceRequest> GuestTransfers::take_requests()
{
    std::vector<DeviceRequest> taken;
    taken.swap(requests_);
    return taken;
}

size_t transferred(const Urb &urb)
{
    if (urb.kind != UrbKind::CONTROL) {
        return std::min(urb.data.size(), urb.length);
    }
    return urb.status == 0 ? std::min<size_t>(urb.data.size(), urb.setup.length) : 0;
}

Bytes received(const Urb &urb)
{
    const bool to_device = urb.kind == UrbKind::CONTROL && !urb.setup.to_host();
    const size_t count = to_device ? 0 : transferred(urb);
    return Bytes(urb.data.begin(), urb.data.begin() + static_cast<Bytes::difference_type>(count));
}

} // namespace bridge_sim
