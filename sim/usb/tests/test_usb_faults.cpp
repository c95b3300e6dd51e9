// Twenty and more deliberate faults of a device, each of which the host model must flag, and as what it is.
#include "cmocka_cpp.h"

#include <functional>

#include "scripted_device.h"
#include "usb_host.h"

using namespace bridge_sim;

namespace
{

constexpr size_t LIMIT = 64;
constexpr uint64_t TOO_LATE = 150; // cycles; a host waits 102
const Bytes PAYLOAD = {1, 0x55, 0xAA, 0x00};

enum class Ask { IN, DAMAGED_IN, OUT, SETUP };

struct Fault {
    const char *name;
    Ask ask;
    Bytes answer; // to each attempt
    uint64_t HostCounters::*counter;
    uint64_t delay = 0;
};

Bytes good(bool toggle = false)
{
    return data_packet(toggle, PAYLOAD.data(), PAYLOAD.size());
}

Bytes sized(size_t bytes)
{
    const Bytes data(bytes, 0x3C);
    return data_packet(false, data.data(), data.size());
}

Bytes changed(const std::function<void(Bytes &)> &change)
{
    Bytes packet = good();
    change(packet);
    return packet;
}

const Fault FAULTS[] = {
    {"a payload bit flipped", Ask::IN, changed([](Bytes &p) { p[2] ^= 4; }), &HostCounters::crc_errors},
    {"the CRC not inverted", Ask::IN, changed([](Bytes &p) {
         p[5] ^= 0xFF;
         p[6] ^= 0xFF;
     }),
     &HostCounters::crc_errors},
    {"the CRC's bytes swapped", Ask::IN, changed([](Bytes &p) { std::swap(p[5], p[6]); }), &HostCounters::crc_errors},
    {"a byte missing", Ask::IN, changed([](Bytes &p) { p.erase(p.begin() + 1); }), &HostCounters::crc_errors},
    {"a byte doubled", Ask::IN, changed([](Bytes &p) { p.insert(p.begin() + 1, p[1]); }), &HostCounters::crc_errors},
    {"an identifier without complement", Ask::IN, changed([](Bytes &p) { p[0] ^= 0x10; }), &HostCounters::pid_errors},
    {"DATA2 on a bulk endpoint", Ask::IN, changed([](Bytes &p) { p[0] = 0x87; }), &HostCounters::pid_errors},
    {"MDATA on a bulk endpoint", Ask::IN, changed([](Bytes &p) { p[0] = 0x0F; }), &HostCounters::pid_errors},
    {"a token in answer to IN", Ask::IN, token_packet(PID_IN, 0), &HostCounters::pid_errors},
    {"ACK in answer to IN", Ask::IN, {PID_ACK}, &HostCounters::pid_errors},
    {"NYET in answer to IN", Ask::IN, {0x96}, &HostCounters::pid_errors},
    {"DATA1 where DATA0 is due", Ask::IN, good(true), &HostCounters::duplicates},
    {"one byte too much", Ask::IN, sized(LIMIT + 1), &HostCounters::babbles},
    {"no end", Ask::IN, sized(4 * LIMIT), &HostCounters::babbles},
    {"data without a CRC", Ask::IN, {PID_DATA0, 0}, &HostCounters::babbles},
    {"a handshake with a byte after it", Ask::IN, {PID_NAK, 0}, &HostCounters::pid_errors},
    {"silence to IN", Ask::IN, {}, &HostCounters::timeouts},
    {"an answer to IN too late", Ask::IN, good(), &HostCounters::violations, TOO_LATE},
    {"an answer to a damaged token", Ask::DAMAGED_IN, good(), &HostCounters::violations},
    {"silence to OUT", Ask::OUT, {}, &HostCounters::timeouts},
    {"data in answer to OUT", Ask::OUT, good(), &HostCounters::pid_errors},
    {"an ACK without complement", Ask::OUT, {0xC2}, &HostCounters::pid_errors},
    {"an ACK with a byte after it", Ask::OUT, {PID_ACK, 0}, &HostCounters::babbles},
    {"an ACK too late", Ask::OUT, {PID_ACK}, &HostCounters::violations, TOO_LATE},
    {"NAK to SETUP", Ask::SETUP, {PID_NAK}, &HostCounters::violations},
    {"STALL to SETUP", Ask::SETUP, {PID_STALL}, &HostCounters::violations},
    {"silence to SETUP", Ask::SETUP, {}, &HostCounters::timeouts},
};

void ask(UsbHost &host, Ask what)
{
    Bytes data;
    const uint8_t bytes[8] = {};
    switch (what) {
    case Ask::DAMAGED_IN:
        host.arm(WireFault::BAD_TOKEN);
        host.in(1, LIMIT, data);
        break;
    case Ask::IN:
        host.in(1, LIMIT, data);
        break;
    case Ask::OUT:
        host.out(1, bytes, sizeof bytes);
        break;
    default:
        host.setup(bytes);
        break;
    }
    host.idle(2 * TOO_LATE);
}

void each_fault_is_flagged_as_what_it_is(void **)
{
    static_assert(sizeof FAULTS / sizeof FAULTS[0] >= 20, "twenty at least");
    for (const Fault &fault : FAULTS) {
        ScriptedDevice device;
        UsbHost host(device);
        device.delay = fault.delay;
        device.script.assign(4, fault.answer);
        ask(host, fault.ask);
        if (host.counters().*fault.counter == 0 || host.counters().unexplained == 0) {
            fail_msg("not flagged: %s", fault.name);
        }
    }
}

// What the faults above differ from.
void a_device_without_fault_is_not_flagged(void **)
{
    for (const Ask what : {Ask::IN, Ask::OUT, Ask::SETUP}) {
        ScriptedDevice device;
        UsbHost host(device);
        device.script = {what == Ask::IN ? good() : Bytes{PID_ACK}};
        ask(host, what);
        assert_int_equal(host.counters().unexplained, 0);
    }
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(each_fault_is_flagged_as_what_it_is),
        cmocka_unit_test(a_device_without_fault_is_not_flagged),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
