// Pacing by the wall clock, without waiting for it: at speeds so low or so high that no machine is in between.
#include "cmocka_cpp.h"

#include "pace.h"

using namespace bridge_sim;

namespace
{

constexpr double HARDLY = 1e-9;  // a tick would last days
constexpr double AT_ONCE = 1e12; // a tick lasts less than any look at the clock
constexpr int MOST_MS = 1000;

void without_a_pace_nothing_waits(void **)
{
    Pace pace(0);
    assert_false(pace.on());
    assert_true(pace.due(0) && pace.due(1u << 30));
    assert_int_equal(pace.wait_ms(1, MOST_MS), MOST_MS);
}

void the_first_tick_sets_the_time_of_the_next(void **)
{
    Pace pace(HARDLY);
    assert_true(pace.on());
    assert_true(pace.due(7));
    assert_false(pace.due(8));
    assert_int_equal(pace.wait_ms(8, MOST_MS), MOST_MS);
}

void a_tick_whose_time_has_come_is_not_waited_for(void **)
{
    Pace pace(AT_ONCE);
    for (uint64_t tick = 0; tick < 1000; tick++) {
        assert_true(pace.due(tick));
    }
    assert_int_equal(pace.wait_ms(1000, MOST_MS), 0);
}

void a_host_is_waited_for_until_patience_is_over(void **)
{
    Patience patience;
    for (unsigned i = 0; i < 2; i++) {
        assert_false(patience.over(false));
        while (!patience.over(false)) {
        }
        assert_false(patience.over(true));
    }
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {
        cmocka_unit_test(without_a_pace_nothing_waits),
        cmocka_unit_test(the_first_tick_sets_the_time_of_the_next),
        cmocka_unit_test(a_tick_whose_time_has_come_is_not_waited_for),
        cmocka_unit_test(a_host_is_waited_for_until_patience_is_over),
    };
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
