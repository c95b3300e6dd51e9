// What libusbredirparser calls when a packet of the client has come: each becomes a transfer, or an answer at once.
#include "usbredir_server.h"

#include <cstdio>
#include <cstdlib>

namespace bridge_sim
{

namespace
{

constexpr uint8_t TO_HOST = 0x80;

// Standard requests that the protocol has words of its own for (USB 2.0 table 9-4).
constexpr uint8_t GET_CONFIGURATION = 8;
constexpr uint8_t SET_CONFIGURATION = 9;
constexpr uint8_t GET_INTERFACE = 10;
constexpr uint8_t SET_INTERFACE = 11;
constexpr uint8_t TO_INTERFACE = 1;

} // namespace

struct UsbredirServer::Callbacks {
    static UsbredirServer &of(void *self)
    {
        return *static_cast<UsbredirServer *>(self);
    }

    static void log(void *, int level, const char *message)
    {
        if (level <= usbredirparser_error) {
            std::fprintf(stderr, "whisker-bridge-sim: usbredir: %s\n", message);
        }
    }

    static int read(void *self, uint8_t *bytes, int count)
    {
        Stream &stream = *of(self).stream_;
        const size_t received = stream.receive(bytes, static_cast<size_t>(count));
        return stream.ended() ? -1 : static_cast<int>(received);
    }

    static int write(void *self, uint8_t *bytes, int count)
    {
        Stream &stream = *of(self).stream_;
        const size_t sent = stream.send(bytes, static_cast<size_t>(count));
        return stream.ended() ? -1 : static_cast<int>(sent);
    }

    static void hello(void *self, usb_redir_hello_header *)
    {
        of(self).greeted_ = true;
        of(self).announce();
    }

    static void reset(void *self)
    {
        UsbredirServer &server = of(self);
        if (server.device_) {
            const uint64_t name = server.next_name_++;
            server.pending_[name] = {};
            server.transfers_.bus_reset(name);
        }
    }

    static void set_configuration(void *self, uint64_t id, usb_redir_set_configuration_header *header)
    {
        Pending pending;
        pending.kind = Pending::Kind::SET_CONFIGURATION;
        pending.id = id;
        pending.value = header->configuration;
        of(self).request(pending, {0, SET_CONFIGURATION, header->configuration, 0, 0});
    }

    static void get_configuration(void *self, uint64_t id)
    {
        Pending pending;
        pending.kind = Pending::Kind::GET_CONFIGURATION;
        pending.id = id;
        of(self).request(pending, {TO_HOST, GET_CONFIGURATION, 0, 0, 1});
    }

    static void set_alt(void *self, uint64_t id, usb_redir_set_alt_setting_header *header)
    {
        Pending pending;
        pending.kind = Pending::Kind::SET_ALT;
        pending.id = id;
        pending.interface = header->interface;
        pending.value = header->alt;
        of(self).request(pending, {TO_INTERFACE, SET_INTERFACE, header->alt, header->interface, 0});
    }

    static void get_alt(void *self, uint64_t id, usb_redir_get_alt_setting_header *header)
    {
        Pending pending;
        pending.kind = Pending::Kind::GET_ALT;
        pending.id = id;
        pending.interface = header->interface;
        of(self).request(pending, {TO_HOST | TO_INTERFACE, GET_INTERFACE, 0, header->interface, 1});
    }

    static void start_interrupts(void *self, uint64_t id, usb_redir_start_interrupt_receiving_header *header)
    {
        UsbredirServer &server = of(self);
        const bool first = server.interrupts_.count(header->endpoint) == 0;
        usb_redir_interrupt_receiving_status_header answer{usb_redir_success, header->endpoint};
        usbredirparser_send_interrupt_receiving_status(server.parser_.get(), id, &answer);
        if (first) {
            server.receive_interrupts(header->endpoint);
        }
    }

    static void stop_interrupts(void *self, uint64_t id, usb_redir_stop_interrupt_receiving_header *header)
    {
        of(self).stop_interrupts(header->endpoint);
        usb_redir_interrupt_receiving_status_header answer{usb_redir_success, header->endpoint};
        usbredirparser_send_interrupt_receiving_status(of(self).parser_.get(), id, &answer);
    }

    static void cancel(void *self, uint64_t id)
    {
        of(self).cancel(id);
    }

    static Bytes take(void *self, uint8_t *data, int count)
    {
        const Bytes bytes = data ? Bytes(data, data + count) : Bytes();
        usbredirparser_free_packet_data(of(self).parser_.get(), data);
        return bytes;
    }

    static void control(void *self, uint64_t id, usb_redir_control_packet_header *header, uint8_t *data, int count)
    {
        Pending pending;
        pending.kind = Pending::Kind::CONTROL;
        pending.id = id;
        pending.control = *header;
        GuestTransfer transfer;
        transfer.setup = {header->requesttype, header->request, header->value, header->index, header->length};
        transfer.length = header->length;
        transfer.data = take(self, data, count);
        of(self).begin(pending, std::move(transfer));
    }

    static void bulk(void *self, uint64_t id, usb_redir_bulk_packet_header *header, uint8_t *data, int count)
    {
        Pending pending;
        pending.kind = Pending::Kind::BULK;
        pending.id = id;
        pending.bulk = *header;
        GuestTransfer transfer;
        transfer.address = header->endpoint;
        transfer.length = header->length | static_cast<size_t>(header->length_high) << 16;
        transfer.data = take(self, data, count);
        of(self).begin(pending, std::move(transfer));
    }

    // The bridge has no interrupt endpoint to the device, and none for isochronous transfers.
    static void interrupt(void *self, uint64_t id, usb_redir_interrupt_packet_header *header, uint8_t *data, int count)
    {
        take(self, data, count);
        header->status = usb_redir_stall;
        header->length = 0;
        usbredirparser_send_interrupt_packet(of(self).parser_.get(), id, header, nullptr, 0);
    }

    static void isochronous(void *self, uint64_t, usb_redir_iso_packet_header *, uint8_t *data, int count)
    {
        take(self, data, count);
    }

    static void start_stream(void *self, uint64_t id, usb_redir_start_iso_stream_header *header)
    {
        usb_redir_iso_stream_status_header answer{usb_redir_inval, header->endpoint};
        usbredirparser_send_iso_stream_status(of(self).parser_.get(), id, &answer);
    }

    static void stop_stream(void *self, uint64_t id, usb_redir_stop_iso_stream_header *header)
    {
        usb_redir_iso_stream_status_header answer{usb_redir_inval, header->endpoint};
        usbredirparser_send_iso_stream_status(of(self).parser_.get(), id, &answer);
    }

    static void filter(void *, usbredirfilter_rule *rules, int)
    {
        std::free(rules);
    }

    static void nothing(void *)
    {
    }
};

void UsbredirServer::set_callbacks()
{
    usbredirparser &parser = *parser_;
    parser.priv = this;
    parser.log_func = Callbacks::log;
    parser.read_func = Callbacks::read;
    parser.write_func = Callbacks::write;
    parser.hello_func = Callbacks::hello;
    parser.reset_func = Callbacks::reset;
    parser.set_configuration_func = Callbacks::set_configuration;
    parser.get_configuration_func = Callbacks::get_configuration;
    parser.set_alt_setting_func = Callbacks::set_alt;
    parser.get_alt_setting_func = Callbacks::get_alt;
    parser.start_interrupt_receiving_func = Callbacks::start_interrupts;
    parser.stop_interrupt_receiving_func = Callbacks::stop_interrupts;
    parser.start_iso_stream_func = Callbacks::start_stream;
    parser.stop_iso_stream_func = Callbacks::stop_stream;
    parser.cancel_data_packet_func = Callbacks::cancel;
    parser.control_packet_func = Callbacks::control;
    parser.bulk_packet_func = Callbacks::bulk;
    parser.interrupt_packet_func = Callbacks::interrupt;
    parser.iso_packet_func = Callbacks::isochronous;
    parser.filter_filter_func = Callbacks::filter;
    parser.filter_reject_func = Callbacks::nothing;
    parser.device_disconnect_ack_func = Callbacks::nothing;
}

} // namespace bridge_sim
