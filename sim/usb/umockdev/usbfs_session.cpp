#include "usbfs_session.h"

#include <cerrno>
#include <cstring>

#include <sys/ioctl.h>

namespace bridge_sim
{

namespace
{

constexpr uint8_t SET_CONFIGURATION = 9;
constexpr uint8_t CLEAR_FEATURE = 1;
constexpr uint8_t TO_ENDPOINT = 0x02;

bool read_number(const UsbfsConnection &connection, unsigned &number)
{
    const IoctlDataRef data(connection.argument_data(sizeof number));
    if (data) {
        std::memcpy(&number, data->data, sizeof number);
    }
    return data != nullptr;
}

} // namespace

UsbfsSession::UsbfsSession(std::function<void(DeviceRequest)> post) : post_(std::move(post))
{
}

UsbfsConnection &UsbfsSession::connection_of(UMockdevIoctlClient *client)
{
    auto &connection = connections_[client];
    if (!connection) {
        connection = std::make_unique<UsbfsConnection>(client);
    }
    return *connection;
}

// A closed file gives its interfaces back and its transfers are cancelled, as the kernel does; only a moment later,
// when umockdev's thread has seen the end of its connection.
void UsbfsSession::forget_closed()
{
    for (auto at = connections_.begin(); at != connections_.end();) {
        UsbfsConnection *connection = at->second.get();
        if (!connection->closed()) {
            ++at;
            continue;
        }
        for (auto owner = owners_.begin(); owner != owners_.end();) {
            if (owner->second == connection) {
                DeviceRequest request;
                request.discard = true;
                request.urb.id = owner->first;
                post_(std::move(request));
                owner = owners_.erase(owner);
            } else {
                ++owner;
            }
        }
        for (auto interface = interfaces_.begin(); interface != interfaces_.end();) {
            interface = interface->second == connection ? interfaces_.erase(interface) : std::next(interface);
        }
        at = connections_.erase(at);
    }
}

void UsbfsSession::ioctl(UMockdevIoctlClient *client)
{
    forget_closed();
    UsbfsConnection &connection = connection_of(client);
    connection.asked();
    if (connection.node() != node_) {
        connection.unplugged();
        return ioctl_of_lost_device(connection);
    }
    switch (connection.request()) {
    case USBDEVFS_SUBMITURB:
        return submit(connection);
    case USBDEVFS_REAPURB:
        return connection.reap(true);
    case USBDEVFS_REAPURBNDELAY:
        return connection.reap(false);
    case USBDEVFS_DISCARDURB:
        return discard(connection);
    case USBDEVFS_CLAIMINTERFACE:
        return claim(connection);
    case USBDEVFS_RELEASEINTERFACE:
        return release(connection);
    case USBDEVFS_SETCONFIGURATION:
        return set_configuration(connection);
    case USBDEVFS_CLEAR_HALT:
        return clear_halt(connection);
    case USBDEVFS_RESET:
        return control(connection, {}, true);
    case USBDEVFS_GET_CAPABILITIES:
        return capabilities(connection);
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL: // detaching or attaching a kernel driver: there is none
        return connection.answer(ENODATA);
    default:
        return connection.answer(ENOTTY);
    }
}

// What had ended before can still be fetched, as in the kernel.
void UsbfsSession::ioctl_of_lost_device(UsbfsConnection &connection)
{
    const unsigned long request = connection.request();
    if (request == USBDEVFS_REAPURB || request == USBDEVFS_REAPURBNDELAY) {
        return connection.reap(false);
    }
    connection.answer(ENODEV);
}

void UsbfsSession::set_node(const std::string &node)
{
    node_ = node;
    for (const auto &[client, connection] : connections_) {
        if (connection->node() != node_) {
            connection->unplugged();
        }
    }
    interfaces_.clear();
}

// ---------------------------------------------------------------------------------------------------------- transfers

void UsbfsSession::submit(UsbfsConnection &connection)
{
    DeviceRequest request;
    const int error = connection.read_urb(request.urb);
    if (error == 0) {
        request.urb.id = next_id_++;
        owners_[request.urb.id] = &connection;
        connection.in_flight(request.urb.id);
        post_(std::move(request));
    }
    connection.answer(error);
}

// The transfer then ends with -ENOENT and what it had received, unless it ends by itself first.
void UsbfsSession::discard(UsbfsConnection &connection)
{
    DeviceRequest request;
    request.discard = true;
    request.urb.id = connection.find(connection.argument());
    const bool found = request.urb.id != 0;
    if (found) {
        post_(std::move(request));
    }
    connection.answer(found ? 0 : EINVAL);
}

void UsbfsSession::completed(std::vector<Urb> urbs)
{
    forget_closed();
    for (const Urb &urb : urbs) {
        const auto owner = owners_.find(urb.id);
        if (owner != owners_.end()) {
            UsbfsConnection *connection = owner->second;
            owners_.erase(owner);
            connection->ended(urb);
        }
    }
}

// --------------------------------------------------------------------------------------------- ioctls that are
// requests

void UsbfsSession::control(UsbfsConnection &connection, const SetupRequest &setup, bool bus_reset)
{
    DeviceRequest request;
    request.urb.id = next_id_++;
    request.urb.kind = bus_reset ? UrbKind::BUS_RESET : UrbKind::CONTROL;
    request.urb.setup = setup;
    owners_[request.urb.id] = &connection;
    connection.wait_for(request.urb.id);
    post_(std::move(request));
}

void UsbfsSession::set_configuration(UsbfsConnection &connection)
{
    unsigned value = 0;
    if (!read_number(connection, value)) {
        return connection.answer(EFAULT);
    }
    control(connection, {0, SET_CONFIGURATION, static_cast<uint16_t>(value), 0, 0}, false);
}

void UsbfsSession::clear_halt(UsbfsConnection &connection)
{
    unsigned endpoint = 0;
    if (!read_number(connection, endpoint)) {
        return connection.answer(EFAULT);
    }
    control(connection, {TO_ENDPOINT, CLEAR_FEATURE, 0, static_cast<uint16_t>(endpoint), 0}, false);
}

void UsbfsSession::claim(UsbfsConnection &connection)
{
    unsigned interface = 0;
    if (!read_number(connection, interface)) {
        return connection.answer(EFAULT);
    }
    const auto owner = interfaces_.emplace(interface, &connection).first;
    connection.answer(owner->second == &connection ? 0 : EBUSY);
}

void UsbfsSession::release(UsbfsConnection &connection)
{
    unsigned interface = 0;
    if (!read_number(connection, interface)) {
        return connection.answer(EFAULT);
    }
    const auto owner = interfaces_.find(interface);
    const bool own = owner != interfaces_.end() && owner->second == &connection;
    if (own) {
        interfaces_.erase(owner);
    }
    connection.answer(own ? 0 : EINVAL);
}

void UsbfsSession::capabilities(UsbfsConnection &connection)
{
    const uint32_t flags =
        USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
    const IoctlDataRef data(connection.argument_data(sizeof flags));
    if (data) {
        std::memcpy(data->data, &flags, sizeof flags);
    }
    connection.answer(data ? 0 : EFAULT);
}

} // namespace bridge_sim
