// The whole bridge packet by packet. Asleep it samples nothing, keeps everything, and the frames say how long it was;
// orders of an update do nothing to nodes that run.
#include "cmocka_cpp.h"

#include <algorithm>

#include "bridge_model.h"
#include "ticking_bridge.h"
#include "usb_control.h"
#include "whisker_protocol.h"

using namespace bridge_sim;

namespace
{

constexpr uint64_t RESUME_CYCLES = 2000; // a real host drives 20 ms
constexpr size_t NODES = 6;
constexpr size_t PACKET = WHISKER_LIMIT_BULK_PACKET;
constexpr uint64_t LINK_CYCLES =
    519; // a tick at divider 6 and gap 30 (fpga/tb/cycles.py), and the cycle it is asked in

struct Fixture {
    NodeBus nodes{NODES, 1};
    NorFlash flash;
    BridgeModel bridge{nodes, flash};
    UsbHost host{bridge};
    Bytes stream;

    Fixture()
    {
        nodes.power_on();
        Descriptors descriptors;
        const char *error = nullptr;
        assert_true(enumerate(host, descriptors, error));
    }
    // SET_REPORT of a report that begins with these bytes; the rest is zeros.
    void set_report(Bytes report, size_t size)
    {
        report.resize(size);
        const SetupRequest set = {0x21, 9, static_cast<uint16_t>(0x0300 | report[0]), WHISKER_LIMIT_USB_HID_INTERFACE,
                                  static_cast<uint16_t>(size)};
        assert_true(control_transfer(host, set, report) == Outcome::OK);
    }
    void run(uint8_t run)
    {
        Bytes report = {WHISKER_REPORT_ID_CONTROL, WHISKER_WIRE_VERSION, run, 6, 30, 3};
        report.resize(WHISKER_REPORT_CONTROL_BYTES);
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_LANE_MASK], (1u << NODES) - 1);
        whisker_put_u32(&report[WHISKER_REPORT_CONTROL_TICK_PERIOD], WHISKER_LIMIT_TICK_PERIOD);
        set_report(report, WHISKER_REPORT_CONTROL_BYTES);
    }
    void order(uint8_t command)
    {
        set_report({WHISKER_REPORT_ID_SERVICE, WHISKER_WIRE_VERSION, command}, WHISKER_REPORT_SERVICE_BYTES);
    }
    uint16_t status(size_t frame, size_t lane) const
    {
        const size_t record = WHISKER_FRAME_HEADER_BYTES + lane * WHISKER_RECORD_BYTES;
        return whisker_get_u16(&stream.at(frame * WHISKER_FRAME_BYTES + record + WHISKER_RECORD_STATUS));
    }
    void ticks(int count)
    {
        while (count-- > 0) {
            bridge.start_tick();
            bridge.cycle();
            assert_true(bridge.link_busy());
            while (bridge.link_busy()) {
                bridge.cycle();
            }
            nodes.run();
        }
    }
    // Ticks that the bridge only counts.
    void ticks_asleep(int count)
    {
        while (count-- > 0) {
            bridge.start_tick();
            bridge.cycle();
            assert_false(bridge.link_busy());
            host.idle(1000);
            assert_true(bridge.running());
        }
    }
    void sleep()
    {
        assert_true(host.bus().suspend());
    }
    void wake()
    {
        assert_true(host.bus().resume(RESUME_CYCLES));
    }
    void read()
    {
        Bytes data;
        host.idle(2 * PACKET);
        while (host.in(1, PACKET, data) == Outcome::OK) {
            stream.insert(stream.end(), data.begin(), data.end());
            host.idle(2 * PACKET);
        }
    }
    void expect_ticks(const std::vector<uint32_t> &ticks) const
    {
        assert_int_equal(stream.size(), ticks.size() * WHISKER_FRAME_BYTES);
        for (size_t i = 0; i < ticks.size(); i++) {
            const uint8_t *frame = &stream[i * WHISKER_FRAME_BYTES];
            assert_int_equal(whisker_get_u32(frame + WHISKER_FRAME_HEADER_TICK), ticks[i]);
            assert_int_equal(whisker_get_u64(frame + WHISKER_FRAME_HEADER_TIME),
                             static_cast<uint64_t>(ticks[i]) * WHISKER_LIMIT_TICK_PERIOD);
            assert_int_equal(whisker_get_u32(frame + WHISKER_FRAME_HEADER_SEQUENCE), i);
            assert_int_equal(whisker_get_u32(frame + WHISKER_FRAME_HEADER_DROPPED), 0);
            assert_int_equal(frame[WHISKER_FRAME_HEADER_FLAGS], i + 1 == ticks.size() ? WHISKER_FRAME_FLAG_LAST : 0);
        }
    }
};

void a_sleeping_bridge_counts_ticks_and_makes_none(void **)
{
    Fixture f;
    f.run(1);
    f.ticks(4);
    f.read();
    f.sleep();
    f.ticks_asleep(5);
    f.wake();
    f.ticks(3);
    f.read();
    f.run(0);
    f.ticks(1);
    f.read();
    f.expect_ticks({0, 1, 2, 8, 9, 10, 11});
    for (size_t lane = 0; lane < NODES; lane++) { // the first records are from before
        assert_int_equal(f.status(3, lane) >> WHISKER_STATUS_CODE_SHIFT, WHISKER_CODE_LINK_TICK);
        assert_int_not_equal(f.status(4, lane) >> WHISKER_STATUS_CODE_SHIFT, WHISKER_CODE_LINK_TICK);
    }
    assert_int_equal(f.host.counters().unexplained, 0);
}

// What was not read before comes afterwards, and it may sleep twice.
void frames_outlive_sleep(void **)
{
    Fixture f;
    f.run(1);
    f.ticks(6);
    f.sleep();
    f.ticks_asleep(2);
    f.wake();
    f.ticks(2);
    f.sleep();
    f.ticks_asleep(1);
    f.wake();
    f.run(0);
    f.ticks(1);
    f.read();
    f.expect_ticks({0, 1, 2, 3, 4, 7, 8, 10});
    assert_int_equal(f.host.counters().unexplained, 0);
}

void a_reset_wakes_and_ends_the_run(void **)
{
    Fixture f;
    f.run(1);
    f.ticks(3);
    f.sleep();
    f.ticks_asleep(2);
    assert_true(f.host.reset());
    assert_false(f.bridge.running());
    Descriptors descriptors;
    const char *error = nullptr;
    assert_true(enumerate(f.host, descriptors, error));
    f.read();
    assert_int_equal(f.stream.size(), 0);
}

// The loader alone writes flash, and a node leaves for it only when it is asked to.
void update_orders_to_running_nodes_do_nothing(void **)
{
    constexpr int BEFORE = 20;
    constexpr uint8_t ORDERS[] = {WHISKER_SERVICE_COMMAND_BEGIN, WHISKER_SERVICE_COMMAND_BLOCK,
                                  WHISKER_SERVICE_COMMAND_FINISH};
    Fixture f;
    f.run(1);
    f.ticks(BEFORE);
    f.read();
    for (const uint8_t command : ORDERS) {
        f.order(command);
        f.ticks(4);
        f.read();
    }
    f.run(0);
    f.ticks(1);
    f.read();
    const size_t frames = f.stream.size() / WHISKER_FRAME_BYTES;
    assert_int_equal(frames, BEFORE + 4 * sizeof ORDERS);
    for (size_t frame = BEFORE - 1; frame < frames; frame++) {
        for (size_t lane = 0; lane < NODES; lane++) {
            assert_int_equal(f.status(frame, lane) >> WHISKER_STATUS_CODE_SHIFT, WHISKER_CODE_OK);
        }
    }
}

// Beyond what the settings allow: every tick that the link has time for becomes a frame, and no faster pace does.
void the_link_bounds_the_pace(void **)
{
    constexpr uint64_t TICKS = 100;
    RunSettings settings = RunSettings::fastest();
    settings.asked_every = LINK_CYCLES;
    assert_true(run_bridge(settings, TICKS).sustained(TICKS));
    settings.asked_every--;
    assert_false(run_bridge(settings, TICKS).sustained(TICKS));
}

// As on a board: no tick comes from outside, and the host asks without a pause.
void its_own_ticks_are_even_and_dated_by_the_host(void **)
{
    constexpr uint64_t TICKS = 12;
    constexpr double LIMIT_US = 600;
    for (const bool every : {false, true}) {
        RunSettings settings;
        settings.options = every ? WHISKER_CONTROL_OPTION_EVERY_FRAME : 0;
        const BridgeRun run = run_bridge(settings, TICKS);
        assert_int_equal(run.bad, 0);
        for (size_t i = 1; i < run.syncs.size(); i++) {
            assert_int_equal(run.syncs[i] - run.syncs[i - 1], WHISKER_LIMIT_TICK_PERIOD);
        }
        assert_int_equal(run.dates[0], 0); // no start-of-frame packet yet
        for (size_t i = 1; i < run.dates.size(); i++) {
            assert_int_equal(run.dates[i], 0x8000u | (run.host[i] - 1));
        }
        const uint64_t worst = *std::max_element(run.packets.begin(), run.packets.end());
        assert_true((static_cast<double>(worst) / 60 <= LIMIT_US) == every);
        assert_true(run.transfers(4) == run.packets || !every);
        assert_int_equal(run.sizes.front(), every ? WHISKER_FRAME_BYTES : PACKET);
        assert_int_equal(*std::max_element(run.sizes.begin(), run.sizes.end()), run.sizes.front());
    }
}

// What control_registers takes as the shortest period, with every record good and no frame lost.
void the_shortest_period_is_kept(void **)
{
    RunSettings settings;
    settings.options = WHISKER_CONTROL_OPTION_EVERY_FRAME;
    settings.tick_period = WHISKER_LIMIT_TICK_PERIOD_MIN;
    const BridgeRun run = run_bridge(settings, 40);
    assert_int_equal(run.bad, 0);
    assert_int_equal(run.syncs[39] - run.syncs[0], 39 * WHISKER_LIMIT_TICK_PERIOD_MIN);
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(a_sleeping_bridge_counts_ticks_and_makes_none),
        cmocka_unit_test(frames_outlive_sleep),
        cmocka_unit_test(a_reset_wakes_and_ends_the_run),
        cmocka_unit_test(update_orders_to_running_nodes_do_nothing),
        cmocka_unit_test(the_link_bounds_the_pace),
        cmocka_unit_test(its_own_ticks_are_even_and_dated_by_the_host),
        cmocka_unit_test(the_shortest_period_is_kept),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
