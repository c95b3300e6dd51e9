// A short soak; usb-soak runs the same for as long as one likes.
#include "cmocka_cpp.h"

#include "frame_soak.h"

using namespace bridge_sim;

namespace
{

void frames_survive_faults_noise_and_resets(void **)
{
    for (uint64_t seed : {1u, 2u}) {
        FrameSoak soak(seed);
        const SoakResult &result = soak.run(6000);
        assert_int_equal(result.gaps, 0);
        assert_int_equal(result.duplicates, 0);
        assert_int_equal(result.wrong, 0);
        assert_int_equal(result.stale, 0);
        assert_int_equal(result.answered, 0);
        assert_int_equal(result.unexplained, 0);
        assert_int_equal(result.hangs, 0);
        assert_true(result.wire_faults > 100 && result.noise > 100 && result.restarts > 1 && result.resets > 0);
    }
}

} // namespace

int main()
{
    const CMUnitTest tests[] = {cmocka_unit_test(frames_survive_faults_noise_and_resets)};
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
