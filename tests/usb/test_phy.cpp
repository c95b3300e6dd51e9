// The device behind shim and PHY, while the PHY is late, deaf, or begins its packets the other way.
#include "cmocka_cpp.h"

#include "ulpi_device.h"
#include "usb_control.h"

using namespace bridge_sim;

namespace
{

constexpr uint8_t BULK = 1;
constexpr size_t PACKET = 512;
constexpr uint64_t MS = 60000;           // cycles
constexpr uint64_t RESUME_CYCLES = 2000; // a real host drives 20 ms

struct Fixture {
    UlpiDevice device;
    UsbHost host{device};

    explicit Fixture(const PhyTraits &traits) : device(traits)
    {
        device.byte = [](uint64_t index) { return static_cast<uint8_t>(3 * index ^ index >> 9); };
        device.available = 20 * PACKET;
    }
    void expect_device()
    {
        Descriptors descriptors;
        const char *error = nullptr;
        if (!enumerate(host, descriptors, error)) {
            fail_msg("%s", error);
        }
        assert_int_equal(descriptors.configuration.size(), 50);
        Bytes data;
        for (uint64_t read = 0; read < 5 * PACKET;) {
            host.idle(2 * PACKET);
            assert_true(host.in(BULK, PACKET, data) == Outcome::OK);
            assert_int_equal(data.size(), PACKET);
            for (const uint8_t byte : data) {
                assert_int_equal(byte, device.byte(read++));
            }
        }
        assert_int_equal(host.counters().unexplained, 0);
        assert_in_range(device.slowest_answer(), 1, device.answer_limit());
    }
};

void a_phy_that_is_late_or_deaf_is_waited_for(void **)
{
    for (const PhyTraits &traits :
         {PhyTraits{0, 0, true}, PhyTraits{5000, 0, false}, PhyTraits{0, 5, false}, PhyTraits{8 * MS, 3, true}}) {
        Fixture f(traits);
        f.expect_device();
    }
}

// Until it is set up nothing is on the bus: the host gives the port up and resets it again.
void a_phy_later_than_the_host_waits_is_found_at_the_next_reset(void **)
{
    Fixture f({11 * MS, 0, false});
    assert_false(f.host.reset());
    assert_false(f.device.ready());
    f.host.idle(2 * MS);
    assert_true(f.device.ready());
    f.expect_device();
}

// Tokens strike at every cycle after the device has begun to change its mode: its register write is cut short and made
// again.
void a_mode_is_written_though_packets_cut_it_short(void **)
{
    uint64_t aborted = 0;
    for (uint64_t delay = 0; delay < 16; delay++) {
        Fixture f({});
        assert_true(f.host.reset());
        f.device.in.line_state = LINE_SE0;
        while (f.device.out.term_select == 0) { // until 3 ms of nothing take it to full speed
            f.device.cycle();
        }
        f.host.idle(MS); // asleep
        assert_true(f.device.suspended());
        f.device.in.line_state = LINE_K;
        for (uint64_t i = 0; i < RESUME_CYCLES; i++) {
            f.device.cycle();
        }
        f.device.in.line_state = LINE_SE0; // the end of resume: high speed is due
        for (uint64_t i = 0; i < delay; i++) {
            f.device.cycle();
        }
        const uint64_t before = f.device.phy().aborted();
        f.host.bus().send(token_packet(PID_SOF, 0));
        f.host.bus().send(token_packet(PID_SOF, 0));
        aborted += f.device.phy().aborted() - before;
        f.host.idle(100);
        assert_int_equal(f.device.out.term_select, 0);
        f.expect_device();
    }
    assert_true(aborted > 0);
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(a_phy_that_is_late_or_deaf_is_waited_for),
        cmocka_unit_test(a_phy_later_than_the_host_waits_is_found_at_the_next_reset),
        cmocka_unit_test(a_mode_is_written_though_packets_cut_it_short),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
