/* The robot in a simulated world: its wheels move the world's base, and its bumper meets the walls. */
#include "robot.h"

#include "create_ground.h"
#include "whisker_constants.h"

static sim_world *world;

/* A square room of 2 m, the robot in its middle. */
static void enter(double theta)
{
    static struct sim_scene scene;
    scene = (struct sim_scene){.size_x = 2, .size_y = 2, .tile_m = 2, .textures = 1, .columns = 1, .rows = 1};
    strcpy(scene.texture[0], "SMOOTH");
    scene.body_radius = CREATE_OI_BODY_DIAMETER_MM / 2000;
    scene.start = (struct sim_pose){1, 1, theta};
    sim_world_free(world);
    world = sim_world_new(&scene, 1);
    assert_non_null(world);
    ready(CREATE_OI_V2, CREATE_OI_OP_SAFE);
}

static void pass_in_world(unsigned ticks)
{
    for (unsigned i = 0; i < ticks; i++) {
        create_ground_drive(robot.create, world);
        sim_world_step(world);
        create_ground_tick(robot.create, world);
    }
}

static void test_side_of_the_bumper(void **state)
{
    (void)state;
    const uint32_t left = SIM_CREATE_BUMP_LEFT, right = SIM_CREATE_BUMP_RIGHT;
    assert_int_equal(create_ground_bumps(0, 0), left | right);
    assert_int_equal(create_ground_bumps(0, 0.5), left);
    assert_int_equal(create_ground_bumps(0, -0.5), right);
    assert_int_equal(create_ground_bumps(0, 1.6), 0);
    assert_int_equal(create_ground_bumps(0, -3), 0);
    assert_int_equal(create_ground_bumps(0.002, 0.5), 0);
    assert_int_equal(create_ground_bumps(-0.01, -1.5), right);
}

static void test_wheels_move_the_base(void **state)
{
    (void)state;
    enter(0.5);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 200, 0, 200);
    pass_in_world(TICKS_PER_S);
    assert_near(sim_world_pose(world).x, 1 + 0.2 * cos(0.5), 1e-6);
    assert_in_range(robot.create->distance_mm, 180, 220); /* with the errors of the wheels */
    SEND(CREATE_OI_OP_DRIVE_DIRECT, HIGH(-129), LOW(-129), 0, 129);
    pass_in_world(TICKS_PER_S / 2);
    assert_near(sim_world_pose(world).theta, 0, 1e-6);
    assert_in_range(-robot.create->angle_deg, 25, 32);
}

static void test_a_wall_presses_the_bumper(void **state)
{
    (void)state;
    enter(0.4); /* meets the wall ahead with its right side */
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 200, 0, 200);
    pass_in_world(6 * TICKS_PER_S);
    assert_true(sim_world_blocked(world));
    assert_int_equal(robot.create->sensor[CREATE_OI_BUMPS_DROPS], CREATE_OI_BUMP_RIGHT);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, 0, 0, 0, 0);
    pass_in_world(TICKS_PER_S / 10); /* it still leans on it */
    assert_int_equal(robot.create->sensor[CREATE_OI_BUMPS_DROPS], CREATE_OI_BUMP_RIGHT);
    SEND(CREATE_OI_OP_DRIVE_DIRECT, HIGH(-200), LOW(-200), HIGH(-200), LOW(-200));
    pass_in_world(TICKS_PER_S / 10);
    assert_int_equal(robot.create->sensor[CREATE_OI_BUMPS_DROPS], 0);
}

static int leave(void **state)
{
    sim_world_free(world);
    return end_robot(state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_side_of_the_bumper),
        cmocka_unit_test(test_wheels_move_the_base),
        cmocka_unit_test(test_a_wall_presses_the_bumper),
    };
    return cmocka_run_group_tests(tests, NULL, leave);
}
