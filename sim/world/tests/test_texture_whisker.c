#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "robot.h"
#include "texture_whisker.h"

enum { LEFT_FLOOR = 4 };

/* What is travelled is the path of the tip, not of the robot: turning on the spot drags it too, backwards on the left.
 */
static void test_travel_is_the_tips(void **state)
{
    (void)state;
    struct sim_scene scene = bench(4, 2, 2, 0);
    const struct sim_floor_texture *floor = mech_floor_texture("VINYL");
    struct sim_texture_whisker whisker;
    sim_texture_whisker_start(&whisker, &scene, LEFT_FLOOR, floor, sim_rng_stream(1, 3, 0));
    for (int n = 1; n <= 1000; n++)
        sim_texture_whisker_move(&whisker, (struct sim_pose){2, 2, n * 1e-3}, floor, 0);
    assert_near(whisker.travelled_m, hypot(0.02, 0.21), 1e-6);
    assert_true(whisker.drag.tilt[0] > 0);
}

static void test_unknown_floor(void **state)
{
    (void)state;
    assert_null(mech_floor_texture("GRASS"));
    assert_string_equal(mech_floor_texture("ROUGH")->name, "ROUGH");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_travel_is_the_tips),
        cmocka_unit_test(test_unknown_floor),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
