// USB/IP: the codec against bytes written out by hand from the protocol's description, and the server with a client
// that goes right and wrong.
#include "server_fixture.h"

#include <algorithm>
#include <cerrno>
#include <stdexcept>

#include "usbip_server.h"

using namespace bridge_sim;

namespace
{

const Bytes LIST = {0x01, 0x11, 0x80, 0x05, 0, 0, 0, 0};
constexpr size_t HEADER = 48;
constexpr size_t DEVICE = 312;

Bytes import_request()
{
    Bytes bytes(8 + 32);
    const uint8_t head[] = {0x01, 0x11, 0x80, 0x03, 0, 0, 0, 0, '1', '-', '1'};
    std::copy(std::begin(head), std::end(head), bytes.begin());
    return bytes;
}

Bytes words(std::initializer_list<uint32_t> values)
{
    Bytes bytes;
    for (const uint32_t value : values) {
        for (int shift = 24; shift >= 0; shift -= 8) {
            bytes.push_back(static_cast<uint8_t>(value >> shift));
        }
    }
    return bytes;
}

// Command, sequence number, device, direction, endpoint, flags, length, start, packets, interval, SETUP.
Bytes submit(uint32_t sequence, uint32_t direction, uint32_t endpoint, uint32_t length, Bytes setup = Bytes(8))
{
    Bytes bytes = words({1, sequence, 0x10002, direction, endpoint, 0, length, 0, 0, 0});
    bytes.insert(bytes.end(), setup.begin(), setup.end());
    return bytes;
}

Bytes unlink(uint32_t sequence, uint32_t which)
{
    Bytes bytes = words({2, sequence, 0x10002, 0, 0, which});
    bytes.resize(HEADER);
    return bytes;
}

void assert_refused(UsbipDecoder &decoder)
{
    bool refused = false;
    try {
        decoder.next();
    } catch (const std::runtime_error &) {
        refused = true;
    }
    assert_true(refused);
}

UsbipDecoder after_import()
{
    UsbipDecoder decoder;
    const Bytes request = import_request();
    decoder.feed(request.data(), request.size());
    assert_true(decoder.next()->bus_id == "1-1");
    return decoder;
}

void decoder_waits_for_the_last_byte(void **)
{
    UsbipDecoder decoder = after_import();
    Bytes bytes = submit(7, 0, 0, 3, {0x21, 9, 1, 3, 1, 0, 3, 0});
    bytes.insert(bytes.end(), {1, 2, 3});
    for (const uint8_t byte : bytes) {
        assert_false(decoder.next().has_value());
        decoder.feed(&byte, 1);
    }
    const auto message = decoder.next();
    assert_true(message && message->data == Bytes({1, 2, 3}));
    assert_int_equal(message->sequence, 7);
    assert_int_equal(message->setup.value, 0x0301);
    assert_false(decoder.next().has_value());
}

void decoder_refuses_what_is_no_usbip(void **)
{
    const Bytes wrong[] = {{0x01, 0x06, 0x80, 0x05, 0, 0, 0, 0}, {0x01, 0x11, 0x80, 0x07, 0, 0, 0, 0}};
    for (const Bytes &bytes : wrong) {
        UsbipDecoder decoder;
        decoder.feed(bytes.data(), bytes.size());
        assert_refused(decoder);
    }
}

void decoder_refuses_commands_beyond_its_limits(void **)
{
    Bytes isochronous = submit(1, 1, 1, 512);
    isochronous[35] = 4;
    Bytes unknown = submit(1, 1, 1, 512);
    unknown[3] = 9;
    const Bytes wrong[] = {submit(1, 1, 16, 512), submit(1, 0, 1, USBIP_TRANSFER_MAX + 1), isochronous, unknown};
    for (const Bytes &bytes : wrong) {
        UsbipDecoder decoder = after_import();
        decoder.feed(bytes.data(), bytes.size());
        assert_refused(decoder);
    }
}

void list_shows_the_device(void **)
{
    UsbipServer server(0);
    server.plug(test_descriptors());
    TestClient client(server, server.port());
    client.send(LIST);
    const Bytes answer = client.receive(8 + 4 + DEVICE + 2 * 4);
    assert_int_equal(answer[11], 1);
    assert_string_equal(reinterpret_cast<const char *>(&answer[12 + 256]), "1-1");
    const Bytes numbers(answer.begin() + 12 + 256 + 32, answer.end());
    const Bytes due = {0, 0, 0, 1, 0, 0, 0, 2, 0,    0, 0, 3, 0x12, 0x09, 0, 1,
                       0, 2, 0, 0, 0, 1, 1, 2, 0xFF, 0, 0, 0, 3,    0,    0, 0};
    assert_true(numbers == due);
}

void unplugged_it_is_not_listed_nor_imported(void **)
{
    UsbipServer server(0);
    TestClient client(server, server.port());
    client.send(LIST);
    assert_true(client.receive(12) == Bytes({1, 0x11, 0, 5, 0, 0, 0, 0, 0, 0, 0, 0}));
    client.send(import_request());
    assert_true(client.receive(8) == Bytes({1, 0x11, 0, 3, 0, 0, 0, 4}));
    client.expect_end();
}

// A client that has imported the device; the reset that goes before it is answered.
void attach(UsbipServer &server, TestClient &client)
{
    client.send(import_request());
    const DeviceRequest reset = client.await_request();
    assert_true(reset.urb.kind == UrbKind::BUS_RESET);
    complete(server, reset, 0);
    assert_true(Bytes({1, 0x11, 0, 3, 0, 0, 0, 0}) == client.receive(8));
    client.receive(DEVICE);
}

// A plugged device and the client that has it.
struct Attached {
    UsbipServer server{0};
    TestClient client{server, server.port()};

    Attached()
    {
        server.plug(test_descriptors());
        attach(server, client);
    }
};

void transfers_go_there_and_back(void **)
{
    Attached attached;
    auto &[server, client] = attached;
    client.send(submit(5, 1, 1, 512));
    const DeviceRequest request = client.await_request();
    assert_true(request.urb.kind == UrbKind::BULK_IN && request.urb.length == 512);
    complete(server, request, 0, {9, 8, 7});
    Bytes due = words({3, 5, 0, 0, 0, 0, 3});
    due.resize(HEADER);
    due.insert(due.end(), {9, 8, 7});
    assert_true(client.receive(HEADER + 3) == due);
}

void interrupts_are_taken_by_themselves(void **)
{
    Attached attached;
    auto &[server, client] = attached;
    client.send(submit(5, 1, 2, 64));
    const DeviceRequest request = client.await_request();
    assert_true(request.urb.kind == UrbKind::INTERRUPT_IN && request.urb.length == 64);
    complete(server, request, 0, {1});
    assert_int_equal(client.receive(HEADER + 1)[HEADER], 1);
}

void errors_are_reported(void **)
{
    Attached attached;
    auto &[server, client] = attached;
    client.send(submit(6, 1, 0, 8, {0xC0, 0x55, 0, 0, 0, 0, 8, 0}));
    complete(server, client.await_request(), -EPIPE);
    assert_true(client.receive(HEADER)[23] == static_cast<uint8_t>(-EPIPE));
    client.send(submit(7, 1, 5, 512)); // no such endpoint
    assert_true(client.receive(HEADER)[23] == static_cast<uint8_t>(-EPIPE));
    client.send(submit(8, 1, 0, 4, {0x80, 6, 0, 1, 0, 0, 18, 0})); // less room than the SETUP asks for
    assert_true(client.receive(HEADER)[23] == static_cast<uint8_t>(-EINVAL));
}

void unlink_ends_a_transfer(void **)
{
    Attached attached;
    auto &[server, client] = attached;
    client.send(submit(5, 1, 1, 512));
    const DeviceRequest request = client.await_request();
    client.send(unlink(6, 5));
    const DeviceRequest discard = client.await_request();
    assert_true(discard.discard && discard.urb.id == request.urb.id);
    complete(server, request, -ENOENT);
    Bytes due = words({4, 6, 0, 0, 0, static_cast<uint32_t>(-ECONNRESET)});
    due.resize(HEADER);
    assert_true(client.receive(HEADER) == due);
    client.send(unlink(7, 5)); // too late
    assert_int_equal(client.receive(HEADER)[23], 0);
}

void unlinked_data_is_not_lost(void **)
{
    Attached attached;
    auto &[server, client] = attached;
    client.send(submit(5, 1, 1, 512));
    const DeviceRequest request = client.await_request();
    client.send(unlink(6, 5));
    client.await_request();
    complete(server, request, -ENOENT, {1, 2});
    const Bytes answer = client.receive(HEADER + 2);
    assert_true(answer[3] == 3 && answer[27] == 2 && answer[HEADER + 1] == 2);
    const Bytes unlinked = client.receive(HEADER);
    assert_true(unlinked[3] == 4 && unlinked[23] == 0);
}

void one_client_has_it(void **)
{
    UsbipServer server(0);
    server.plug(test_descriptors());
    TestClient other(server, server.port());
    {
        TestClient client(server, server.port());
        attach(server, client);
        other.send(LIST);
        assert_int_equal(other.receive(12)[11], 0);
        other.send(import_request());
        assert_int_equal(other.receive(8)[7], 2);
        other.expect_end();
        client.send(submit(5, 1, 1, 512));
        client.await_request();
    }
    TestClient next(server, server.port()); // the one before is gone, and its transfer ended
    next.send(import_request());
    assert_true(next.await_request().discard);
    assert_true(next.await_request().urb.kind == UrbKind::BUS_RESET);
}

void the_cable_ends_the_connection(void **)
{
    Attached attached;
    auto &[server, client] = attached;
    server.unplug();
    client.expect_end();
}

void nonsense_ends_the_connection_only(void **)
{
    UsbipServer server(0);
    server.plug(test_descriptors());
    TestClient client(server, server.port());
    client.send(submit(5, 1, 1, 512));
    client.expect_end();
    TestClient next(server, server.port());
    attach(server, next);
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(decoder_waits_for_the_last_byte),
        cmocka_unit_test(decoder_refuses_what_is_no_usbip),
        cmocka_unit_test(decoder_refuses_commands_beyond_its_limits),
        cmocka_unit_test(list_shows_the_device),
        cmocka_unit_test(unplugged_it_is_not_listed_nor_imported),
        cmocka_unit_test(transfers_go_there_and_back),
        cmocka_unit_test(interrupts_are_taken_by_themselves),
        cmocka_unit_test(errors_are_reported),
        cmocka_unit_test(unlink_ends_a_transfer),
        cmocka_unit_test(unlinked_data_is_not_lost),
        cmocka_unit_test(one_client_has_it),
        cmocka_unit_test(the_cable_ends_the_connection),
        cmocka_unit_test(nonsense_ends_the_connection_only),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
