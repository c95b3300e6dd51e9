#include "usbip_server.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <stdexcept>

namespace bridge_sim
{

namespace
{

constexpr size_t CONNECTIONS_MAX = 16;
constexpr size_t PIECE_BYTES = 65536;
constexpr uint8_t TO_HOST = 0x80;
// The bus reset that goes before an import; transfers are named by their sequence numbers, which have 32 bits.
constexpr uint64_t IMPORT_RESET = UINT64_MAX;

} // namespace

struct UsbipServer::Connection {
    Stream stream;
    UsbipDecoder decoder;
    bool over = false; // nothing more is read
};

UsbipServer::UsbipServer(uint16_t port) : listener_(port, waker_)
{
}

UsbipServer::~UsbipServer() = default;

uint16_t UsbipServer::port() const
{
    return listener_.port();
}

int UsbipServer::wake_descriptor() const
{
    return waker_.descriptor();
}

void UsbipServer::plug(const Descriptors &descriptors)
{
    device_ = std::make_unique<Descriptors>(descriptors);
    transfers_.set_device(UsbLayout::parse(descriptors));
}

// A client learns of it by the end of its connection: the protocol has no other word for it.
void UsbipServer::unplug()
{
    device_.reset();
    connections_.remove_if([this](const Connection &one) { return &one == owner_; });
    detach();
}

void UsbipServer::detach()
{
    owner_ = nullptr;
    unlinks_.clear();
    transfers_.forget_all();
}

// ------------------------------------------------------------------------------------------------------------ requests

std::vector<DeviceRequest> UsbipServer::take_requests()
{
    accept_all();
    connections_.remove_if([this](Connection &connection) {
        const bool goes_on = serve(connection);
        if (!goes_on && &connection == owner_) {
            detach();
        }
        return !goes_on;
    });
    return transfers_.take_requests();
}

void UsbipServer::accept_all()
{
    while (auto socket = listener_.accept()) {
        if (connections_.size() < CONNECTIONS_MAX) {
            connections_.push_back({Stream(std::move(*socket), waker_), {}});
        }
    }
}

// False: the connection has ended.
bool UsbipServer::serve(Connection &connection)
{
    uint8_t bytes[PIECE_BYTES];
    connection.stream.flush();
    try {
        while (const size_t count = connection.stream.receive(bytes, sizeof bytes)) {
            connection.decoder.feed(bytes, count);
            while (auto message = connection.decoder.next()) {
                handle(connection, std::move(*message));
            }
        }
    } catch (const std::exception &error) {
        std::fprintf(stderr, "whisker-bridge-sim: %s: connection closed\n", error.what());
        return false;
    }
    return !connection.stream.ended() && !connection.over;
}

void UsbipServer::handle(Connection &connection, UsbipMessage message)
{
    switch (message.kind) {
    case UsbipMessage::Kind::LIST:
        connection.stream.send_all(usbip_list_answer(owner_ ? nullptr : device_.get()));
        return;
    case UsbipMessage::Kind::IMPORT:
        return import(connection, message.bus_id);
    case UsbipMessage::Kind::SUBMIT:
        return submit(connection, std::move(message));
    case UsbipMessage::Kind::UNLINK:
        return unlink(connection, message);
    }
}

// The bridge is reset first, for a client that attaches finds a device just plugged in.
void UsbipServer::import(Connection &connection, const std::string &bus_id)
{
    const bool present = device_ && bus_id == USBIP_BUS_ID;
    if (!present || owner_) {
        const UsbipStatus status = present ? UsbipStatus::BUSY : UsbipStatus::NO_DEVICE;
        connection.stream.send_all(usbip_import_answer(status, {}));
        connection.over = true;
        return;
    }
    owner_ = &connection;
    transfers_.bus_reset(IMPORT_RESET);
}

void UsbipServer::submit(Connection &connection, UsbipMessage message)
{
    if (&connection != owner_) {
        throw std::runtime_error("USB/IP: a transfer for a device that was not imported");
    }
    GuestTransfer transfer;
    transfer.address = static_cast<uint8_t>(message.endpoint | (message.to_host ? TO_HOST : 0));
    transfer.setup = message.setup;
    transfer.length = message.length;
    transfer.data = std::move(message.data);
    const int error = transfers_.submit(message.sequence, std::move(transfer));
    if (error != 0) {
        connection.stream.send_all(usbip_submit_answer(message.sequence, error, 0, {}));
    }
}

void UsbipServer::unlink(Connection &connection, const UsbipMessage &message)
{
    if (&connection == owner_ && transfers_.discard(message.unlinked)) {
        unlinks_[message.unlinked] = message.sequence;
    } else {
        connection.stream.send_all(usbip_unlink_answer(message.sequence, 0));
    }
}

// ------------------------------------------------------------------------------------------------------------- results

void UsbipServer::deliver(std::vector<Urb> completed)
{
    for (const Urb &urb : completed) {
        const std::optional<uint64_t> name = transfers_.ended(urb);
        if (!name) {
            continue;
        }
        if (*name == IMPORT_RESET) {
            imported(urb.status);
        } else {
            answer(static_cast<uint32_t>(*name), urb);
        }
    }
}

void UsbipServer::imported(int status)
{
    const UsbipStatus result = status == 0 ? UsbipStatus::OK : UsbipStatus::NO_DEVICE;
    owner_->stream.send_all(usbip_import_answer(result, *device_));
    if (status != 0) {
        owner_->over = true;
    }
}

// A transfer that was ended on request while it held data is answered as one that ended before the request, for the
// protocol's answer to the request has no room for data.
void UsbipServer::answer(uint32_t sequence, const Urb &urb)
{
    const auto unlink = unlinks_.find(sequence);
    const bool unlinked = unlink != unlinks_.end();
    const bool in_vain = urb.status == -ENOENT && transferred(urb) == 0;
    if (!unlinked || !in_vain) {
        const int status = urb.status == -ENOENT ? -ECONNRESET : urb.status;
        const auto actual = static_cast<uint32_t>(transferred(urb));
        owner_->stream.send_all(usbip_submit_answer(sequence, status, actual, received(urb)));
    }
    if (unlinked) {
        owner_->stream.send_all(usbip_unlink_answer(unlink->second, in_vain ? -ECONNRESET : 0));
        unlinks_.erase(unlink);
    }
}

} // namespace bridge_sim
