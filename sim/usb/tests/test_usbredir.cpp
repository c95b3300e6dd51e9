// The usbredir server with libusbredirparser itself at the client's end, as QEMU has it, and with nonsense.
#include "server_fixture.h"

#include <cerrno>

#include "usbredir_server.h"

using namespace bridge_sim;

namespace
{

// A guest: keeps what the server said last.
class Guest
{
  public:
    Guest(UsbredirServer &server, bool greets = true) : client_(server, server.port()), parser_(usbredirparser_create())
    {
        uint32_t capabilities[USB_REDIR_CAPS_SIZE] = {0};
        usbredirparser_caps_set_cap(capabilities, usb_redir_cap_connect_device_version);
        usbredirparser_caps_set_cap(capabilities, usb_redir_cap_ep_info_max_packet_size);
        usbredirparser_caps_set_cap(capabilities, usb_redir_cap_64bits_ids);
        usbredirparser_caps_set_cap(capabilities, usb_redir_cap_32bits_bulk_length);
        set_callbacks();
        usbredirparser_init(parser_, "test", capabilities, USB_REDIR_CAPS_SIZE,
                            greets ? 0 : usbredirparser_fl_no_hello);
    }

    ~Guest()
    {
        usbredirparser_destroy(parser_);
    }

    usbredirparser *parser()
    {
        return parser_;
    }

    TestClient &client()
    {
        return client_;
    }

    void send()
    {
        while (usbredirparser_has_data_to_write(parser_) > 0) {
            usbredirparser_do_write(parser_);
        }
    }

    // Lets the server work until it has said something of this kind.
    void await(const bool &said)
    {
        send();
        while (!said) {
            client_.work();
            usbredirparser_do_read(parser_);
        }
    }

    bool connected = false, disconnected = false, configured = false, received = false, stopped = false,
         data_came = false;
    usb_redir_device_connect_header device{};
    usb_redir_ep_info_header endpoints{};
    usb_redir_interface_info_header interfaces{};
    usb_redir_configuration_status_header configuration{};
    usb_redir_interrupt_receiving_status_header receiving{};
    uint8_t status = 0xFF;
    uint64_t id = 0;
    Bytes data;

  private:
    static Guest &of(void *self)
    {
        return *static_cast<Guest *>(self);
    }

    static int read(void *self, uint8_t *bytes, int count)
    {
        const ssize_t got = recv(of(self).client_.descriptor(), bytes, static_cast<size_t>(count), MSG_DONTWAIT);
        return got > 0 ? static_cast<int>(got) : 0;
    }

    static int write(void *self, uint8_t *bytes, int count)
    {
        return static_cast<int>(::send(of(self).client_.descriptor(), bytes, static_cast<size_t>(count), MSG_NOSIGNAL));
    }

    void keep(uint64_t given, uint8_t result, uint8_t *bytes, int count)
    {
        data_came = true;
        id = given;
        status = result;
        data = bytes ? Bytes(bytes, bytes + count) : Bytes();
        usbredirparser_free_packet_data(parser_, bytes);
    }

    void set_callbacks()
    {
        parser_->priv = this;
        parser_->read_func = read;
        parser_->write_func = write;
        parser_->log_func = [](void *, int, const char *) {};
        parser_->hello_func = [](void *, usb_redir_hello_header *) {};
        parser_->ep_info_func = [](void *self, usb_redir_ep_info_header *header) { of(self).endpoints = *header; };
        parser_->interface_info_func = [](void *self, usb_redir_interface_info_header *header) {
            of(self).interfaces = *header;
        };
        parser_->device_connect_func = [](void *self, usb_redir_device_connect_header *header) {
            of(self).device = *header;
            of(self).connected = true;
        };
        parser_->device_disconnect_func = [](void *self) { of(self).disconnected = true; };
        parser_->configuration_status_func = [](void *self, uint64_t, usb_redir_configuration_status_header *header) {
            of(self).configuration = *header;
            of(self).configured = true;
        };
        parser_->interrupt_receiving_status_func = [](void *self, uint64_t,
                                                      usb_redir_interrupt_receiving_status_header *header) {
            of(self).receiving = *header;
            of(self).received = true;
        };
        parser_->control_packet_func = [](void *self, uint64_t name, usb_redir_control_packet_header *header,
                                          uint8_t *bytes,
                                          int count) { of(self).keep(name, header->status, bytes, count); };
        parser_->bulk_packet_func = [](void *self, uint64_t name, usb_redir_bulk_packet_header *header, uint8_t *bytes,
                                       int count) { of(self).keep(name, header->status, bytes, count); };
        parser_->interrupt_packet_func = [](void *self, uint64_t name, usb_redir_interrupt_packet_header *header,
                                            uint8_t *bytes,
                                            int count) { of(self).keep(name, header->status, bytes, count); };
    }

    TestClient client_;
    usbredirparser *parser_;
};

// A guest that has seen the device.
struct Plugged {
    Plugged()
    {
        server.plug(test_descriptors());
        guest.await(guest.connected);
    }

    UsbredirServer server{0};
    Guest guest{server};
};

void read_bulk(Guest &guest, uint64_t id, uint32_t length)
{
    usb_redir_bulk_packet_header header{};
    header.endpoint = 0x81;
    header.length = static_cast<uint16_t>(length);
    header.length_high = static_cast<uint16_t>(length >> 16);
    usbredirparser_send_bulk_packet(guest.parser(), id, &header, nullptr, 0);
    guest.send();
}

void the_device_is_announced(void **)
{
    Plugged test;
    assert_int_equal(test.guest.device.vendor_id, 0x1209);
    assert_int_equal(test.guest.device.speed, usb_redir_speed_high);
    assert_int_equal(test.guest.interfaces.interface_count, 2);
    assert_int_equal(test.guest.interfaces.interface_class[1], 3);
    assert_int_equal(test.guest.endpoints.type[17], usb_redir_type_bulk);
    assert_int_equal(test.guest.endpoints.max_packet_size[17], 512);
    assert_int_equal(test.guest.endpoints.interval[18], 8);
    assert_int_equal(test.guest.endpoints.type[1], usb_redir_type_invalid);
}

void it_is_announced_when_it_is_plugged(void **)
{
    UsbredirServer server(0);
    Guest guest(server);
    guest.send();
    guest.client().work();
    server.plug(test_descriptors());
    guest.await(guest.connected);
    server.unplug();
    guest.await(guest.disconnected);
}

void a_control_transfer_goes_there_and_back(void **)
{
    Plugged test;
    usb_redir_control_packet_header header{0x80, 6, 0x80, 0, 0x0100, 0, 18};
    usbredirparser_send_control_packet(test.guest.parser(), 11, &header, nullptr, 0);
    test.guest.send();
    const DeviceRequest request = test.guest.client().await_request();
    assert_int_equal(request.urb.setup.value, 0x0100);
    complete(test.server, request, 0, Bytes(18, 5));
    test.guest.await(test.guest.data_came);
    assert_true(test.guest.id == 11 && test.guest.status == usb_redir_success && test.guest.data == Bytes(18, 5));
}

void a_stall_is_reported(void **)
{
    Plugged test;
    usb_redir_control_packet_header header{0, 9, 0x21, 0, 0x0301, 1, 3};
    uint8_t data[] = {1, 2, 3};
    usbredirparser_send_control_packet(test.guest.parser(), 12, &header, data, sizeof data);
    test.guest.send();
    const DeviceRequest request = test.guest.client().await_request();
    assert_true(request.urb.data == Bytes({1, 2, 3}));
    complete(test.server, request, -EPIPE);
    test.guest.await(test.guest.data_came);
    assert_true(test.guest.status == usb_redir_stall && test.guest.data.empty());
}

void long_bulk_transfers_have_long_lengths(void **)
{
    Plugged test;
    read_bulk(test.guest, 13, 0x20000);
    const DeviceRequest request = test.guest.client().await_request();
    assert_int_equal(request.urb.length, 0x20000);
    complete(test.server, request, 0, Bytes(0x20000, 3));
    test.guest.await(test.guest.data_came);
    assert_int_equal(test.guest.data.size(), 0x20000);
}

void a_cancelled_transfer_is_answered_so(void **)
{
    Plugged test;
    read_bulk(test.guest, 14, 512);
    const DeviceRequest request = test.guest.client().await_request();
    usbredirparser_send_cancel_data_packet(test.guest.parser(), 14);
    test.guest.send();
    const DeviceRequest discard = test.guest.client().await_request();
    assert_true(discard.discard && discard.urb.id == request.urb.id);
    complete(test.server, request, -ENOENT);
    test.guest.await(test.guest.data_came);
    assert_int_equal(test.guest.status, usb_redir_cancelled);
}

void settings_have_answers_of_their_own(void **)
{
    Plugged test;
    usb_redir_set_configuration_header header{1};
    usbredirparser_send_set_configuration(test.guest.parser(), 15, &header);
    test.guest.send();
    const DeviceRequest request = test.guest.client().await_request();
    assert_true(request.urb.setup.request == 9 && request.urb.setup.value == 1);
    complete(test.server, request, 0);
    test.guest.await(test.guest.configured);
    assert_true(test.guest.configuration.status == usb_redir_success && test.guest.configuration.configuration == 1);
}

void interrupts_come_until_they_are_stopped(void **)
{
    Plugged test;
    usb_redir_start_interrupt_receiving_header start{0x82};
    usbredirparser_send_start_interrupt_receiving(test.guest.parser(), 16, &start);
    test.guest.await(test.guest.received);
    DeviceRequest request = test.guest.client().await_request();
    assert_true(request.urb.kind == UrbKind::INTERRUPT_IN && request.urb.length == 64);
    complete(test.server, request, -ESHUTDOWN); // a new configuration: nothing is said of it
    request = test.guest.client().await_request();
    complete(test.server, request, 0, {4});
    test.guest.await(test.guest.data_came);
    assert_true(test.guest.data == Bytes({4}));
    request = test.guest.client().await_request();
    test.guest.received = false;
    usb_redir_stop_interrupt_receiving_header stop{0x82};
    usbredirparser_send_stop_interrupt_receiving(test.guest.parser(), 17, &stop);
    test.guest.await(test.guest.received);
    assert_true(test.guest.client().await_request().discard);
}

void a_reset_reaches_the_bus(void **)
{
    Plugged test;
    usbredirparser_send_reset(test.guest.parser());
    test.guest.send();
    assert_true(test.guest.client().await_request().urb.kind == UrbKind::BUS_RESET);
}

void endpoints_it_has_not_are_refused(void **)
{
    Plugged test;
    usb_redir_interrupt_packet_header out{0x02, 0, 1};
    uint8_t byte = 0;
    usbredirparser_send_interrupt_packet(test.guest.parser(), 18, &out, &byte, 1);
    test.guest.await(test.guest.data_came);
    assert_int_equal(test.guest.status, usb_redir_stall);
}

void a_client_that_goes_leaves_nothing(void **)
{
    UsbredirServer server(0);
    server.plug(test_descriptors());
    {
        Guest guest(server);
        guest.await(guest.connected);
        read_bulk(guest, 19, 512);
        guest.client().await_request();
    }
    Guest next(server);
    next.await(next.connected);
    assert_true(next.client().await_request().discard);
}

void nonsense_ends_the_connection_only(void **)
{
    UsbredirServer server(0);
    server.plug(test_descriptors());
    {
        TestClient client(server, server.port());
        client.send(Bytes(200, 0xFF));
        client.receive(1); // the server's hello, of which the rest does not matter
        uint8_t rest[4096];
        for (ssize_t got = 1; got != 0;) {
            client.work();
            got = recv(client.descriptor(), rest, sizeof rest, MSG_DONTWAIT);
            got = got < 0 && errno == ECONNRESET ? 0 : got;
        }
    }
    Guest next(server);
    next.await(next.connected);
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(the_device_is_announced),
        cmocka_unit_test(it_is_announced_when_it_is_plugged),
        cmocka_unit_test(a_control_transfer_goes_there_and_back),
        cmocka_unit_test(a_stall_is_reported),
        cmocka_unit_test(long_bulk_transfers_have_long_lengths),
        cmocka_unit_test(a_cancelled_transfer_is_answered_so),
        cmocka_unit_test(settings_have_answers_of_their_own),
        cmocka_unit_test(interrupts_come_until_they_are_stopped),
        cmocka_unit_test(a_reset_reaches_the_bus),
        cmocka_unit_test(endpoints_it_has_not_are_refused),
        cmocka_unit_test(a_client_that_goes_leaves_nothing),
        cmocka_unit_test(nonsense_ends_the_connection_only),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
