// The plan of faults: the seed alone decides, the rates hold, and no two faults get in each other's way.
#include "cmocka_cpp.h"

#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include <unistd.h>

#include "fault_list.h"
#include "fault_plan.h"

using namespace bridge_sim;

namespace
{

constexpr uint64_t MINUTE = 120000;
constexpr size_t SIX = 6;

struct Drawn {
    std::vector<LaneFault> lane;
    std::vector<UsbFault> usb;
};

Drawn draw(uint64_t seed, uint64_t ticks)
{
    FaultPlan plan(seed, SIX, ticks);
    Drawn drawn;
    for (uint64_t tick = 0; tick < ticks; tick++) {
        if (const auto fault = plan.lane_fault(tick)) {
            drawn.lane.push_back(*fault);
        }
        if (const auto fault = plan.usb_fault(tick)) {
            drawn.usb.push_back(*fault);
        }
    }
    return drawn;
}

void a_minute_has_enough_of_each(void **)
{
    const Drawn drawn = draw(1, MINUTE);
    unsigned lane_kinds = 0;
    unsigned usb_kinds = 0;
    for (const LaneFault &fault : drawn.lane) {
        lane_kinds |= 1u << static_cast<unsigned>(fault.kind);
        assert_true(fault.lane < SIX);
    }
    for (const UsbFault &fault : drawn.usb) {
        usb_kinds |= 1u << static_cast<unsigned>(fault.kind);
    }
    assert_true(drawn.lane.size() >= 100);
    assert_true(drawn.usb.size() >= 20);
    assert_int_equal(lane_kinds, (1u << LANE_FAULT_KINDS) - 1);
    assert_int_equal(usb_kinds, (1u << USB_FAULT_KINDS) - 1);
}

void faults_keep_their_distance(void **)
{
    const std::vector<LaneFault> faults = draw(2, MINUTE).lane;
    for (size_t i = 1; i < faults.size(); i++) {
        assert_true(faults[i].tick - faults[i - 1].tick >= 4);
    }
    assert_true(faults.back().tick + 4 < MINUTE);
}

void the_seed_decides(void **)
{
    const std::vector<LaneFault> once = draw(3, MINUTE).lane;
    const std::vector<LaneFault> again = draw(3, MINUTE).lane;
    const std::vector<LaneFault> other = draw(4, MINUTE).lane;
    size_t equal = 0;
    for (size_t i = 0; i < once.size(); i++) {
        assert_int_equal(once[i].tick, again[i].tick);
        assert_int_equal(once[i].argument, again[i].argument);
        equal += once[i].tick == other[i].tick ? 1 : 0;
    }
    assert_true(equal < once.size() / 2);
}

FaultList read_text(const char *text)
{
    char path[] = "/tmp/whisker-faults-XXXXXX";
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    assert_int_equal(write(descriptor, text, strlen(text)), strlen(text));
    close(descriptor);
    try {
        FaultList list = read_fault_list(path, SIX);
        unlink(path);
        return list;
    } catch (...) {
        unlink(path);
        throw;
    }
}

void given_faults_strike_and_no_others(void **)
{
    FaultList list = read_text("lane 7 5 link_flip 63\nusb 7 host_away\nlane 9 0 sensor_dead 0\n");
    FaultPlan plan(list.lane, list.usb);
    for (uint64_t tick = 0; tick < MINUTE / 100; tick++) {
        const std::optional<LaneFault> lane = plan.lane_fault(tick);
        const std::optional<UsbFault> usb = plan.usb_fault(tick);
        assert_int_equal(lane.has_value(), tick == 7 || tick == 9);
        assert_int_equal(usb.has_value(), tick == 7);
        if (tick == 7) {
            assert_true(lane->lane == 5 && lane->kind == LaneFaultKind::LINK_FLIP && lane->argument == 63);
            assert_true(usb->kind == UsbFaultKind::HOST_AWAY);
        }
    }
}

void what_lasts_may_overlap(void **)
{
    const FaultList list =
        read_text("lasting 5 9 0 sensor_frozen\nlane 7 5 link_flip 63\nlasting 2 18446744073709551615 0 "
                  "link_dead\n");
    const FaultPlan plan(list.lane, list.usb, list.lasting);
    assert_int_equal(plan.lasting().size(), 2);
    assert_true(plan.lasting()[0].kind == LastingKind::SENSOR_FROZEN && plan.lasting()[0].until == 9);
    assert_true(plan.lasting()[1].kind == LastingKind::LINK_DEAD && plan.lasting()[1].until == UINT64_MAX);
}

void wrong_lists_name_line_and_remedy(void **)
{
    const std::pair<const char *, const char *> wrong[] = {
        {"usb 5 nak_storm\nlane 5 6 link_dead 0\n", "line 2: lane 6 is not populated; give 0 to 5"},
        {"lane 5 0 nak_storm 0\n", "line 1: 'nak_storm' is no such fault; use one of sensor_flip"},
        {"usb 5 bad_data\nusb 5 bad_data\n", "line 2: tick 5 after tick 5; give one fault per tick"},
        {"lasting 5 9 6 link_dead\n", "line 1: lane 6 is not populated; give 0 to 5"},
        {"lasting 5 9 0 link_flip\n", "line 1: 'link_flip' is no such fault; use one of sensor_dead, sensor_frozen"},
        {"breakfast\n", "line 1: 'breakfast'; give 'lane TICK"},
    };
    for (const auto &[text, complaint] : wrong) {
        std::string said;
        try {
            read_text(text);
        } catch (const std::runtime_error &error) {
            said = error.what();
        }
        assert_true(said.find(complaint) != std::string::npos);
    }
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(a_minute_has_enough_of_each),
        cmocka_unit_test(faults_keep_their_distance),
        cmocka_unit_test(the_seed_decides),
        cmocka_unit_test(given_faults_strike_and_no_others),
        cmocka_unit_test(what_lasts_may_overlap),
        cmocka_unit_test(wrong_lists_name_line_and_remedy),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
