// A short soak; usb-soak runs the same for as long as one likes.
#include "cmocka_cpp.h"

#include "device_kind.h"
#include "frame_soak.h"

using namespace bridge_sim;

namespace
{

std::unique_ptr<DeviceKind> device_kind;

void frames_survive_faults_noise_and_resets(void **)
{
    for (uint64_t seed : {1u, 2u}) {
        const std::unique_ptr<StreamDevice> device = device_kind->make();
        FrameSoak soak(*device, seed);
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

int main(int argc, char **argv)
{
    device_kind = std::make_unique<DeviceKind>(argc, argv);
    const CMUnitTest tests[] = {cmocka_unit_test(frames_survive_faults_noise_and_resets)};
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
