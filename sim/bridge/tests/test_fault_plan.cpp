// The plan of faults: the seed alone decides, the rates hold, and no two faults get in each other's way.
#include "cmocka_cpp.h"

#include <vector>

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

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(a_minute_has_enough_of_each),
        cmocka_unit_test(faults_keep_their_distance),
        cmocka_unit_test(the_seed_decides),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
