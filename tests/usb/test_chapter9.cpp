// Every request of USB 2.0 chapter 9, valid and not, in each of the states default, address and configured.
#include "cmocka_cpp.h"

#include <algorithm>
#include <string>

#include "usb_control.h"
#include "usb_device.h"

using namespace bridge_sim;

namespace
{

constexpr uint8_t ADDRESS = 9;
constexpr uint8_t BULK = 1;
constexpr size_t BULK_PACKET = 512;
enum State { DEFAULT, ADDRESSED, CONFIGURED, STATES };
constexpr const char *STATE_NAMES[] = {"default", "address", "configured"};
constexpr Outcome OK = Outcome::OK;
constexpr Outcome NO = Outcome::STALL;

struct Row {
    const char *name;
    SetupRequest request;
    Outcome outcome[STATES];
    Bytes answer;  // its beginning, where the outcome is OK
    int size = -1; // of the answer, where it is to be checked
    bool changes = false;
};

const SetupRequest READ_DEVICE = {0x80, 6, 0x0100, 0, 18};

// Requests are {bmRequestType, bRequest, wValue, wIndex, wLength}.
const Row ROWS[] = {
    {"status of the device", {0x80, 0, 0, 0, 2}, {OK, OK, OK}, {1, 0}, 2},
    {"status, one byte of it", {0x80, 0, 0, 0, 1}, {OK, OK, OK}, {1}, 1},
    {"status, room for more", {0x80, 0, 0, 0, 64}, {OK, OK, OK}, {1, 0}, 2},
    {"status with a value", {0x80, 0, 1, 0, 2}, {NO, NO, NO}, {}},
    {"status of device 1", {0x80, 0, 0, 1, 2}, {NO, NO, NO}, {}},
    {"status of interface 0", {0x81, 0, 0, 0, 2}, {NO, NO, OK}, {0, 0}, 2},
    {"status of interface 1", {0x81, 0, 0, 1, 2}, {NO, NO, OK}, {0, 0}, 2},
    {"status of interface 2", {0x81, 0, 0, 2, 2}, {NO, NO, NO}, {}},
    {"status of endpoint 0", {0x82, 0, 0, 0, 2}, {OK, OK, OK}, {0, 0}, 2},
    {"status of endpoint 0 IN", {0x82, 0, 0, 0x80, 2}, {OK, OK, OK}, {0, 0}, 2},
    {"status of endpoint 1 IN", {0x82, 0, 0, 0x81, 2}, {NO, NO, OK}, {0, 0}, 2},
    {"status of endpoint 2 IN", {0x82, 0, 0, 0x82, 2}, {NO, NO, OK}, {0, 0}, 2},
    {"status of endpoint 1 OUT", {0x82, 0, 0, 0x01, 2}, {NO, NO, NO}, {}},
    {"status of endpoint 3 IN", {0x82, 0, 0, 0x83, 2}, {NO, NO, NO}, {}},
    {"status of something else", {0x83, 0, 0, 0, 2}, {NO, NO, NO}, {}},
    {"clear halt of endpoint 0", {0x02, 1, 0, 0, 0}, {OK, OK, OK}, {}},
    {"clear halt of endpoint 1", {0x02, 1, 0, 0x81, 0}, {NO, NO, OK}, {}},
    {"clear halt of endpoint 2", {0x02, 1, 0, 0x82, 0}, {NO, NO, OK}, {}},
    {"clear halt of endpoint 3", {0x02, 1, 0, 0x83, 0}, {NO, NO, NO}, {}},
    {"clear an unknown feature", {0x02, 1, 5, 0x81, 0}, {NO, NO, NO}, {}},
    {"clear remote wake-up", {0x00, 1, 1, 0, 0}, {NO, NO, NO}, {}},
    {"clear test mode", {0x00, 1, 2, 0, 0}, {NO, NO, NO}, {}},
    {"clear an interface's feature", {0x01, 1, 0, 0, 0}, {NO, NO, NO}, {}},
    {"set remote wake-up", {0x00, 3, 1, 0, 0}, {NO, NO, NO}, {}},
    {"set test mode", {0x00, 3, 2, 0x0100, 0}, {NO, NO, NO}, {}},
    {"set an unknown endpoint's halt", {0x02, 3, 0, 0x03, 0}, {NO, NO, NO}, {}},
    {"set halt with data", {0x02, 3, 0, 0x81, 2}, {NO, NO, NO}, {}},
    {"set address beyond 127", {0x00, 5, 128, 0, 0}, {NO, NO, NO}, {}},
    {"set address with an index", {0x00, 5, 5, 1, 0}, {NO, NO, NO}, {}},
    {"set address with data", {0x00, 5, 5, 0, 1}, {NO, NO, NO}, {}},
    {"set address", {0x00, 5, 77, 0, 0}, {OK, OK, NO}, {}, -1, true},
    {"set address 0", {0x00, 5, 0, 0, 0}, {OK, OK, NO}, {}, -1, true},
    {"device descriptor", {0x80, 6, 0x0100, 0, 18}, {OK, OK, OK}, {18, 1, 0x01, 2}, 18},
    {"device descriptor, too much room", {0x80, 6, 0x0100, 0, 0xFFFF}, {OK, OK, OK}, {18, 1}, 18},
    {"device descriptor, 8 bytes", {0x80, 6, 0x0100, 0, 8}, {OK, OK, OK}, {18, 1}, 8},
    {"device descriptor, 1 byte", {0x80, 6, 0x0100, 0, 1}, {OK, OK, OK}, {18}, 1},
    {"device descriptor, nothing of it", {0x80, 6, 0x0100, 0, 0}, {OK, OK, OK}, {}},
    {"device descriptor 1", {0x80, 6, 0x0101, 0, 18}, {NO, NO, NO}, {}},
    {"configuration descriptor", {0x80, 6, 0x0200, 0, 255}, {OK, OK, OK}, {9, 2, 50, 0, 2, 1}, 50},
    {"configuration descriptor, 9 bytes", {0x80, 6, 0x0200, 0, 9}, {OK, OK, OK}, {9, 2, 50, 0}, 9},
    {"configuration descriptor 1", {0x80, 6, 0x0201, 0, 255}, {NO, NO, NO}, {}},
    {"string 0: languages", {0x80, 6, 0x0300, 0, 255}, {OK, OK, OK}, {4, 3, 9, 4}, 4},
    {"string 1", {0x80, 6, 0x0301, 0x0409, 255}, {OK, OK, OK}, {20, 3, 'C', 0}, 20},
    {"string 3: serial number", {0x80, 6, 0x0303, 0x0409, 255}, {OK, OK, OK}, {10, 3, '0', 0}, 10},
    {"string 99", {0x80, 6, 0x0363, 0x0409, 255}, {NO, NO, NO}, {}},
    {"interface descriptor", {0x80, 6, 0x0400, 0, 9}, {NO, NO, NO}, {}},
    {"endpoint descriptor", {0x80, 6, 0x0500, 0, 7}, {NO, NO, NO}, {}},
    {"qualifier", {0x80, 6, 0x0600, 0, 10}, {OK, OK, OK}, {10, 6, 0x01, 2}, 10},
    {"configuration at the other speed", {0x80, 6, 0x0700, 0, 255}, {OK, OK, OK}, {9, 7, 50, 0}, 50},
    {"where the ROM hides one", {0x80, 6, 0x0800, 0, 255}, {NO, NO, NO}, {}},
    {"where the ROM hides another", {0x80, 6, 0x0A00, 0, 255}, {NO, NO, NO}, {}},
    {"binary object store", {0x80, 6, 0x0F00, 0, 255}, {OK, OK, OK}, {5, 15, 33, 0, 1}, 33},
    {"descriptor of type 0", {0x80, 6, 0x0000, 0, 255}, {NO, NO, NO}, {}},
    {"descriptor of type 255", {0x80, 6, 0xFF00, 0, 255}, {NO, NO, NO}, {}},
    {"report descriptor of the device", {0x80, 6, 0x2200, 0, 255}, {NO, NO, NO}, {}},
    {"report descriptor of interface 0", {0x81, 6, 0x2200, 0, 255}, {NO, NO, NO}, {}},
    {"report descriptor", {0x81, 6, 0x2200, 1, 255}, {OK, OK, OK}, {0x06, 0x00, 0xFF}},
    {"HID descriptor", {0x81, 6, 0x2100, 1, 255}, {OK, OK, OK}, {9, 0x21}, 9},
    {"set a descriptor", {0x00, 7, 0x0100, 0, 18}, {NO, NO, NO}, {}},
    {"configuration now", {0x80, 8, 0, 0, 1}, {OK, OK, OK}, {}, 1},
    {"configuration now, with a value", {0x80, 8, 1, 0, 1}, {NO, NO, NO}, {}},
    {"set configuration 2", {0x00, 9, 2, 0, 0}, {NO, NO, NO}, {}},
    {"set configuration 257", {0x00, 9, 257, 0, 0}, {NO, NO, NO}, {}},
    {"set configuration with an index", {0x00, 9, 1, 1, 0}, {NO, NO, NO}, {}},
    {"set configuration 1", {0x00, 9, 1, 0, 0}, {NO, OK, OK}, {}, -1, true},
    {"set configuration 0", {0x00, 9, 0, 0, 0}, {NO, OK, OK}, {}, -1, true},
    {"setting of interface 0", {0x81, 10, 0, 0, 1}, {NO, NO, OK}, {0}, 1},
    {"setting of interface 1", {0x81, 10, 0, 1, 1}, {NO, NO, OK}, {0}, 1},
    {"setting of interface 2", {0x81, 10, 0, 2, 1}, {NO, NO, NO}, {}},
    {"set setting 0", {0x01, 11, 0, 0, 0}, {NO, NO, OK}, {}},
    {"set setting 1", {0x01, 11, 1, 0, 0}, {NO, NO, NO}, {}},
    {"set setting of interface 2", {0x01, 11, 0, 2, 0}, {NO, NO, NO}, {}},
    {"synch frame", {0x82, 12, 0, 0x81, 2}, {NO, NO, NO}, {}},
    {"request 2", {0x00, 2, 0, 0, 0}, {NO, NO, NO}, {}},
    {"request 255 with data", {0x00, 255, 0, 0, 64}, {NO, NO, NO}, {}},
    {"request 255 for data", {0x80, 255, 0, 0, 64}, {NO, NO, NO}, {}},
    {"Windows' descriptor set", {0xC0, 0x20, 0, 7, 255}, {OK, OK, OK}, {10, 0, 0, 0, 0, 0, 3, 6}, 178},
    {"Windows' set by a wrong index", {0xC0, 0x20, 0, 5, 255}, {NO, NO, NO}, {}},
    {"another vendor request", {0xC0, 0x21, 0, 7, 255}, {NO, NO, NO}, {}},
    {"vendor request with data", {0x40, 0x20, 0, 7, 8}, {NO, NO, NO}, {}},
    {"reserved type", {0xE0, 0, 0, 0, 2}, {NO, NO, NO}, {}},
    {"idle rate", {0xA1, 2, 0, 1, 1}, {NO, NO, OK}, {0}, 1},
    {"set idle rate", {0x21, 10, 0, 1, 0}, {NO, NO, OK}, {}},
    {"set idle rate of interface 0", {0x21, 10, 0, 0, 0}, {NO, NO, NO}, {}},
    {"protocol", {0xA1, 3, 0, 1, 1}, {NO, NO, NO}, {}},
    {"set protocol", {0x21, 11, 0, 1, 0}, {NO, NO, NO}, {}},
    {"an unknown report", {0xA1, 1, 0x0363, 1, 64}, {NO, NO, NO}, {}},
};

struct Fixture {
    UsbDevice device;
    UsbHost host{device};

    explicit Fixture(uint64_t serial = 0) : device(serial)
    {
        device.byte = [](uint64_t index) { return static_cast<uint8_t>(index); };
    }
    Outcome request(const SetupRequest &request, Bytes &data)
    {
        return control_transfer(host, request, data);
    }
    Outcome request(const SetupRequest &given)
    {
        Bytes data(given.length);
        return request(given, data);
    }
    void enter(State state)
    {
        assert_true(host.reset());
        if (state >= ADDRESSED) {
            assert_true(request({0, 5, ADDRESS, 0, 0}) == OK);
        }
        if (state >= CONFIGURED) {
            assert_true(request({0, 9, 1, 0, 0}) == OK);
        }
    }
    Bytes in()
    {
        Bytes data;
        host.idle(2 * BULK_PACKET); // a byte a cycle goes into the endpoint
        assert_true(host.in(BULK, BULK_PACKET, data) == OK);
        return data;
    }
    void regular() const
    {
        assert_int_equal(host.counters().unexplained, 0);
    }
};

void check_row(Fixture &f, const Row &row, State state)
{
    Bytes data(row.request.length);
    const Outcome outcome = f.request(row.request, data);
    const bool begins =
        data.size() >= row.answer.size() && std::equal(row.answer.begin(), row.answer.end(), data.begin());
    const bool sized = row.size < 0 || data.size() == static_cast<size_t>(row.size);
    if (outcome != row.outcome[state] || (outcome == OK && !(begins && sized))) {
        fail_msg("%s in state %s: outcome %d, %zu bytes", row.name, STATE_NAMES[state], static_cast<int>(outcome),
                 data.size());
    }
    data.clear();
    const Outcome afterwards = f.request(READ_DEVICE, data);
    if (afterwards != OK || data.size() != READ_DEVICE.length) {
        fail_msg("%s in state %s: afterwards outcome %d", row.name, STATE_NAMES[state], static_cast<int>(afterwards));
    }
}

void in_state(State state)
{
    Fixture f;
    f.enter(state);
    for (const Row &row : ROWS) {
        check_row(f, row, state);
        if (row.changes) {
            f.enter(state);
        }
    }
    f.regular();
}

void requests_in_the_default_state(void **)
{
    in_state(DEFAULT);
}

void requests_in_the_address_state(void **)
{
    in_state(ADDRESSED);
}

void requests_in_the_configured_state(void **)
{
    in_state(CONFIGURED);
}

void the_configuration_is_reported(void **)
{
    Fixture f;
    Bytes data;
    f.enter(ADDRESSED);
    for (uint8_t configuration : {0, 1, 0}) {
        assert_true(f.request({0, 9, configuration, 0, 0}) == OK);
        assert_true(f.request({0x80, 8, 0, 0, 1}, data) == OK);
        assert_int_equal(data[0], configuration);
    }
    f.regular();
}

// Without a configuration there are no endpoints but 0 (9.1.1.4): silence.
void endpoints_are_silent_until_configured(void **)
{
    Fixture f;
    Bytes data;
    f.enter(ADDRESSED);
    f.device.available = BULK_PACKET;
    for (uint8_t endpoint : {1, 2}) {
        assert_true(f.host.in(endpoint, BULK_PACKET, data) == Outcome::TIMEOUT);
    }
    assert_true(f.request({0, 9, 1, 0, 0}) == OK);
    assert_int_equal(f.in().size(), BULK_PACKET);
    assert_true(f.host.in(2, 64, data) == Outcome::NAK);
}

void halt_stalls_and_clearing_it_resets_the_toggle(void **)
{
    for (uint8_t endpoint : {1, 2}) {
        Fixture f;
        Bytes data;
        const auto index = static_cast<uint16_t>(0x80 | endpoint);
        f.enter(CONFIGURED);
        f.device.available = 5 * BULK_PACKET;
        f.in(); // the next would be DATA1
        assert_true(f.request({0x02, 3, 0, index, 0}) == OK);
        assert_true(f.request({0x82, 0, 0, index, 2}, data) == OK);
        assert_true(data == Bytes({1, 0}));
        assert_true(f.host.in(endpoint, BULK_PACKET, data) == NO);
        assert_true(f.host.in(endpoint, BULK_PACKET, data) == NO);
        assert_true(f.request({0x02, 1, 0, index, 0}) == OK);
        assert_true(f.request({0x82, 0, 0, index, 2}, data) == OK);
        assert_true(data == Bytes({0, 0}));
        assert_true(f.host.in(2, BULK_PACKET, data) == Outcome::NAK);
        f.in();
        f.in();
        f.regular();
    }
}

void a_new_configuration_and_a_reset_end_a_halt(void **)
{
    Fixture f;
    f.enter(CONFIGURED);
    for (int round = 0; round < 2; round++) {
        f.device.available = BULK_PACKET;
        assert_true(f.request({0x02, 3, 0, 0x81, 0}) == OK);
        if (round) {
            f.enter(CONFIGURED);
        } else {
            assert_true(f.request({0, 9, 1, 0, 0}) == OK);
        }
        f.in();
    }
    f.regular();
}

void set_interface_resets_the_toggle_of_its_endpoint(void **)
{
    Fixture f;
    f.enter(CONFIGURED);
    f.device.available = 4 * BULK_PACKET;
    f.in();
    assert_true(f.request({0x01, 11, 0, 0, 0}) == OK);
    f.in();
    assert_true(f.request({0x01, 11, 0, 1, 0}) == OK); // the other interface: nothing changes here
    f.in();
    f.regular();
}

void a_lost_ack_of_the_status_changes_nothing(void **)
{
    Fixture f;
    assert_true(f.host.reset());
    f.host.arm(WireFault::LOST_ACK);
    assert_true(f.request({0, 5, ADDRESS, 0, 0}) == OK);
    assert_true(f.request(READ_DEVICE) == OK); // its first SETUP may go unanswered, the retries do not
    f.host.arm(WireFault::LOST_ACK);
    assert_true(f.request({0, 9, 1, 0, 0}) == OK);
    f.device.available = 2 * BULK_PACKET;
    f.in();
    f.in();
    assert_int_equal(f.host.counters().duplicates, 0);
}

void a_damaged_setup_costs_one_attempt(void **)
{
    Fixture f;
    f.enter(CONFIGURED);
    f.host.arm(WireFault::BAD_SETUP);
    const uint64_t before = f.host.counters().transactions;
    assert_true(f.request({0x00, 9, 1, 0, 0}) == OK);
    assert_int_equal(f.host.counters().transactions - before, 2); // SETUP and status
    f.regular();
}

// Digits, most significant first, in UTF-16.
void the_serial_number_is_the_registers(void **)
{
    Fixture f(0x0123456789ABCDEFull);
    Bytes data;
    Bytes wanted = {34, 3};
    for (char digit : std::string("0123456789ABCDEF")) {
        wanted.push_back(static_cast<uint8_t>(digit));
        wanted.push_back(0);
    }
    f.enter(ADDRESSED);
    for (uint16_t length : {255, 34, 33, 2, 1}) {
        assert_true(f.request({0x80, 6, 0x0303, 0x0409, length}, data) == OK);
        assert_true(data == Bytes(wanted.begin(), wanted.begin() + std::min<uint16_t>(length, 34)));
    }
    f.regular();
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(requests_in_the_default_state),
        cmocka_unit_test(requests_in_the_address_state),
        cmocka_unit_test(requests_in_the_configured_state),
        cmocka_unit_test(the_configuration_is_reported),
        cmocka_unit_test(endpoints_are_silent_until_configured),
        cmocka_unit_test(halt_stalls_and_clearing_it_resets_the_toggle),
        cmocka_unit_test(a_new_configuration_and_a_reset_end_a_halt),
        cmocka_unit_test(set_interface_resets_the_toggle_of_its_endpoint),
        cmocka_unit_test(a_lost_ack_of_the_status_changes_nothing),
        cmocka_unit_test(a_damaged_setup_costs_one_attempt),
        cmocka_unit_test(the_serial_number_is_the_registers),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
