// RTL, nodes and USB host together: every record must carry exactly the counts of the field that was sent.
#include "cmocka_cpp.h"

#include <cstdio>
#include <exception>

#include "bench.h"

using namespace bridge_sim;

namespace
{

// The bench stops at the first thing that is wrong; its line is worth showing.
template <typename Action> void expect_success(Action action)
{
    try {
        action();
    } catch (const std::exception &error) {
        fail_msg("%s", error.what());
    }
}

BenchSettings settings_for(uint64_t ticks, size_t populated)
{
    BenchSettings settings;
    settings.ticks = ticks;
    settings.populated = populated;
    return settings;
}

void run_all(const BenchSettings &settings)
{
    expect_success([&] {
        Bench bench(settings);
        const BenchResult result = bench.run();
        assert_int_equal(result.frames, settings.ticks);
    });
}

void six_lanes_fastest_link(void **)
{
    run_all(settings_for(400, 6));
}

void all_lanes_fastest_link(void **)
{
    run_all(settings_for(400, LANES));
}

void hardware_settings(void **)
{
    BenchSettings settings = settings_for(200, 6);
    settings.sck_divider = WHISKER_LIMIT_SCK_DIVIDER_DEFAULT;
    settings.word_gap = WHISKER_LIMIT_WORD_GAP_DEFAULT;
    settings.sample_point = WHISKER_LIMIT_SAMPLE_POINT_DEFAULT;
    run_all(settings);
}

// Two frames to a packet: a packet and a transfer share their cycles, so a pair of ticks takes little more than two
// transfers. A packet takes a cycle per byte.
void packets_and_transfers_share_the_cycles(void **)
{
    constexpr uint64_t TICKS = 200;
    expect_success([] {
        Bench bench(settings_for(TICKS, 6));
        constexpr uint64_t BITS = WHISKER_RECORD_BYTES * 8, GAPS = WHISKER_RECORD_BYTES / 2 - 1;
        constexpr uint64_t REST = 150; // SYNC, select, start-of-frame packets
        constexpr uint64_t TRANSFER = BITS * WHISKER_LIMIT_SCK_DIVIDER_MIN + GAPS * WHISKER_LIMIT_WORD_GAP_MIN;
        assert_in_range(bench.run().cycles / TICKS, TRANSFER, TRANSFER + REST);
    });
}

// An odd number of frames ends with a short packet, an even one with an empty packet.
void odd_number_of_frames(void **)
{
    run_all(settings_for(33, 6));
}

// 14 lane faults (seven kinds) and seven USB faults (six kinds), by the rates of the plan.
void faults_are_reported_exactly_and_change_nothing_else(void **)
{
    BenchSettings settings = settings_for(14000, 6);
    settings.faults = true;
    expect_success([&] {
        Bench bench(settings);
        bench.run();
        assert_true(bench.faults().pairs().size() >= 14);
        for (unsigned kind = 0; kind < USB_FAULT_KINDS; kind++) {
            assert_true(bench.faults().usb_count(static_cast<UsbFaultKind>(kind)) >= 1);
        }
    });
}

// 2k + 1 frames leave an odd packet half filled and a whole one untaken when the reset comes: nothing of it may appear
// in the next run, whose first packet must be DATA0 again.
void reset_of_the_bus(uint64_t ticks_before)
{
    expect_success([&] {
        Bench bench(settings_for(100, 6));
        bench.power_on();
        bench.start();
        bench.ticks(ticks_before);
        bench.enumerate_again();
        bench.start();
        bench.ticks(50);
        bench.stop();
        assert_int_equal(bench.frames_of_run(), 50);
        bench.check_usb();
    });
}

void second_enumeration_after_odd_packets(void **)
{
    reset_of_the_bus(7);
}

void second_enumeration_after_even_packets(void **)
{
    reset_of_the_bus(9);
}

void second_run_without_reset(void **)
{
    expect_success([&] {
        Bench bench(settings_for(100, 6));
        bench.power_on();
        for (uint64_t ticks : {21u, 30u}) {
            bench.start();
            bench.ticks(ticks);
            bench.stop();
            assert_int_equal(bench.frames_of_run(), ticks);
        }
        bench.check_usb();
    });
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(six_lanes_fastest_link),
        cmocka_unit_test(all_lanes_fastest_link),
        cmocka_unit_test(hardware_settings),
        cmocka_unit_test(packets_and_transfers_share_the_cycles),
        cmocka_unit_test(odd_number_of_frames),
        cmocka_unit_test(faults_are_reported_exactly_and_change_nothing_else),
        cmocka_unit_test(second_enumeration_after_odd_packets),
        cmocka_unit_test(second_enumeration_after_even_packets),
        cmocka_unit_test(second_run_without_reset),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
