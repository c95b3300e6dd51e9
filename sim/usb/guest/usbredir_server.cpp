#include "usbredir_server.h"

#include <cerrno>
#include <cstdio>

#include "usbredir_words.h"

namespace bridge_sim
{

namespace
{

constexpr char VERSION[] = "whisker-bridge-sim";
} // namespace

void UsbredirServer::ParserDeleter::operator()(usbredirparser *parser) const
{
    usbredirparser_destroy(parser);
}

UsbredirServer::UsbredirServer(uint16_t port) : GuestPort(port)
{
}

UsbredirServer::~UsbredirServer() = default;

void UsbredirServer::plug(const Descriptors &descriptors)
{
    device_ = std::make_unique<UsbLayout>(UsbLayout::parse(descriptors));
    transfers_.set_device(*device_);
    announce();
    write();
}

void UsbredirServer::unplug()
{
    device_.reset();
    interrupts_.clear();
    pending_.clear();
    transfers_.forget_all();
    if (greeted_) {
        usbredirparser_send_device_disconnect(parser_.get());
        write();
    }
}

void UsbredirServer::announce()
{
    if (!greeted_ || !device_) {
        return;
    }
    usb_redir_ep_info_header endpoints = endpoint_info(*device_);
    usb_redir_interface_info_header interfaces = interface_info(*device_);
    usb_redir_device_connect_header header = connect_info(*device_);
    usbredirparser_send_ep_info(parser_.get(), &endpoints);
    usbredirparser_send_interface_info(parser_.get(), &interfaces);
    usbredirparser_send_device_connect(parser_.get(), &header);
}

// ---------------------------------------------------------------------------------------------------------- connection

// The end of a connection is seen before the next one is.
std::vector<DeviceRequest> UsbredirServer::take_requests()
{
    if (stream_) {
        read();
    }
    accept();
    write();
    return transfers_.take_requests();
}

// A second client is turned away while there is one.
void UsbredirServer::accept()
{
    while (auto socket = listener_.accept()) {
        if (!stream_) {
            stream_ = std::make_unique<Stream>(std::move(*socket), waker_);
            start_parser();
        }
    }
}

void UsbredirServer::start_parser()
{
    uint32_t capabilities[USB_REDIR_CAPS_SIZE] = {0};
    for (const int capability :
         {usb_redir_cap_connect_device_version, usb_redir_cap_filter, usb_redir_cap_ep_info_max_packet_size,
          usb_redir_cap_64bits_ids, usb_redir_cap_32bits_bulk_length}) {
        usbredirparser_caps_set_cap(capabilities, capability);
    }
    parser_.reset(usbredirparser_create());
    set_callbacks();
    usbredirparser_init(parser_.get(), VERSION, capabilities, USB_REDIR_CAPS_SIZE, usbredirparser_fl_usb_host);
}

void UsbredirServer::read()
{
    const int result = usbredirparser_do_read(parser_.get());
    if (result == usbredirparser_read_parse_error) {
        std::fprintf(stderr, "whisker-bridge-sim: usbredir: the client broke the protocol: connection closed\n");
        drop();
    } else if (stream_->ended()) {
        drop();
    }
}

void UsbredirServer::write()
{
    if (parser_ && usbredirparser_has_data_to_write(parser_.get()) > 0) {
        usbredirparser_do_write(parser_.get());
    }
}

void UsbredirServer::drop()
{
    parser_.reset();
    stream_.reset();
    greeted_ = false;
    interrupts_.clear();
    pending_.clear();
    transfers_.forget_all();
}

// ----------------------------------------------------------------------------------------------------------- transfers

void UsbredirServer::begin(Pending pending, GuestTransfer transfer)
{
    const uint64_t name = next_name_++;
    Urb refused;
    refused.setup = transfer.setup;
    refused.status = device_ ? transfers_.submit(name, std::move(transfer)) : -ENODEV;
    if (refused.status == 0) {
        pending_[name] = pending;
    } else {
        end(pending, refused);
    }
}

void UsbredirServer::request(Pending pending, const SetupRequest &setup)
{
    GuestTransfer transfer;
    transfer.setup = setup;
    transfer.length = setup.length;
    begin(pending, std::move(transfer));
}

void UsbredirServer::cancel(uint64_t id)
{
    for (const auto &[name, pending] : pending_) {
        const bool data = pending.kind == Pending::Kind::CONTROL || pending.kind == Pending::Kind::BULK;
        if (data && pending.id == id) {
            transfers_.discard(name);
            return;
        }
    }
}

void UsbredirServer::receive_interrupts(uint8_t endpoint)
{
    Pending pending;
    pending.kind = Pending::Kind::INTERRUPT_IN;
    pending.endpoint = endpoint;
    const UsbEndpoint *known = device_ ? device_->endpoint(endpoint) : nullptr;
    GuestTransfer transfer;
    transfer.address = endpoint;
    transfer.length = known ? known->packet : 0;
    interrupts_.insert(endpoint);
    begin(pending, std::move(transfer));
}

void UsbredirServer::stop_interrupts(uint8_t endpoint)
{
    interrupts_.erase(endpoint);
    for (auto at = pending_.begin(); at != pending_.end();) {
        const bool of_it = at->second.kind == Pending::Kind::INTERRUPT_IN && at->second.endpoint == endpoint;
        if (of_it) {
            transfers_.discard(at->first);
        }
        at = of_it ? pending_.erase(at) : std::next(at);
    }
}

// ------------------------------------------------------------------------------------------------------------- results

void UsbredirServer::deliver(std::vector<Urb> completed)
{
    for (const Urb &urb : completed) {
        const std::optional<uint64_t> name = transfers_.ended(urb);
        const auto at = name ? pending_.find(*name) : pending_.end();
        if (at != pending_.end()) {
            const Pending pending = at->second;
            pending_.erase(at);
            end(pending, urb);
        }
    }
    write();
}

void UsbredirServer::end(const Pending &pending, const Urb &urb)
{
    switch (pending.kind) {
    case Pending::Kind::CONTROL:
        return end_control(pending, urb);
    case Pending::Kind::BULK:
        return end_bulk(pending, urb);
    case Pending::Kind::INTERRUPT_IN:
        return end_interrupt(pending, urb);
    case Pending::Kind::RESET:
        return;
    default:
        return end_setting(pending, urb);
    }
}

void UsbredirServer::end_control(const Pending &pending, const Urb &urb)
{
    usb_redir_control_packet_header header = pending.control;
    Bytes data = received(urb);
    header.status = status_of(urb.status);
    header.length = static_cast<uint16_t>(transferred(urb));
    usbredirparser_send_control_packet(parser_.get(), pending.id, &header, data.data(), static_cast<int>(data.size()));
}

void UsbredirServer::end_bulk(const Pending &pending, const Urb &urb)
{
    usb_redir_bulk_packet_header header = pending.bulk;
    Bytes data = received(urb);
    header.status = status_of(urb.status);
    header.length = static_cast<uint16_t>(data.size());
    header.length_high = static_cast<uint16_t>(data.size() >> 16);
    usbredirparser_send_bulk_packet(parser_.get(), pending.id, &header, data.data(), static_cast<int>(data.size()));
}

// A new configuration ends what waits, but the client still wants the packets to come.
void UsbredirServer::end_interrupt(const Pending &pending, const Urb &urb)
{
    const bool wanted = interrupts_.count(pending.endpoint) > 0;
    if (urb.status == 0) {
        usb_redir_interrupt_packet_header header{};
        Bytes data = received(urb);
        header.endpoint = pending.endpoint;
        header.length = static_cast<uint16_t>(data.size());
        usbredirparser_send_interrupt_packet(parser_.get(), interrupt_id_++, &header, data.data(),
                                             static_cast<int>(data.size()));
    }
    if (wanted && (urb.status == 0 || urb.status == -ESHUTDOWN)) {
        receive_interrupts(pending.endpoint);
    } else if (wanted) {
        interrupts_.erase(pending.endpoint);
        usb_redir_interrupt_receiving_status_header header{status_of(urb.status), pending.endpoint};
        usbredirparser_send_interrupt_receiving_status(parser_.get(), 0, &header);
    }
}

void UsbredirServer::end_setting(const Pending &pending, const Urb &urb)
{
    const uint8_t status = status_of(urb.status);
    const Bytes data = received(urb);
    const uint8_t value = data.empty() ? pending.value : data[0];
    if (pending.kind == Pending::Kind::SET_CONFIGURATION || pending.kind == Pending::Kind::GET_CONFIGURATION) {
        usb_redir_configuration_status_header header{status, value};
        usbredirparser_send_configuration_status(parser_.get(), pending.id, &header);
    } else {
        usb_redir_alt_setting_status_header header{status, pending.interface, value};
        usbredirparser_send_alt_setting_status(parser_.get(), pending.id, &header);
    }
}

} // namespace bridge_sim
