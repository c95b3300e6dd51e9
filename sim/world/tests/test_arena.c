#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "arena.h"
#include "robot.h"

/* Two by two tiles of 0.5 m, the last column cut to 0.4 m, and a box in the upper right corner. */
static struct sim_scene scene(void)
{
    struct sim_scene scene = bench(0.9, 0.2, 0.2, 0);
    scene.size_y = 1.0;
    scene.tile_m = 0.5;
    scene.columns = scene.rows = 2;
    memcpy(scene.tile, (unsigned char[]){0, 1, 2, 3}, 4);
    scene.obstacles = 1;
    scene.obstacle[0] = (struct sim_box){0.6, 0.7, 0.8, 0.9, NULL};
    return scene;
}

static void test_texture_under_a_point(void **state)
{
    (void)state;
    struct sim_scene s = scene();
    assert_int_equal(sim_arena_texture(&s, (struct sim_point){0.1, 0.1}), 0);
    assert_int_equal(sim_arena_texture(&s, (struct sim_point){0.6, 0.4}), 1);
    assert_int_equal(sim_arena_texture(&s, (struct sim_point){0.4, 0.6}), 2);
    assert_int_equal(sim_arena_texture(&s, (struct sim_point){0.7, 0.8}), 3); /* beneath the box */
}

static void test_nearest_tile_beyond_a_wall(void **state)
{
    (void)state;
    struct sim_scene s = scene();
    assert_int_equal(sim_arena_texture(&s, (struct sim_point){-0.1, 0.6}), 2);
    assert_int_equal(sim_arena_texture(&s, (struct sim_point){1.2, -0.3}), 1);
    assert_int_equal(sim_arena_texture(&s, (struct sim_point){0.2, 7}), 2);
    assert_near(sim_arena_inside(&s, (struct sim_point){-0.1, 0.6}), 0, 0);
}

static void test_distance_to_tile_border(void **state)
{
    (void)state;
    struct sim_scene s = scene();
    assert_near(sim_arena_inside(&s, (struct sim_point){0.25, 0.48}), 0.02, 1e-12);
    assert_near(sim_arena_inside(&s, (struct sim_point){0.25, 0.52}), 0.02, 1e-12);
    assert_near(sim_arena_inside(&s, (struct sim_point){0.87, 0.25}), 0.03, 1e-12); /* the wall cuts this tile */
}

static void test_ray_meets_faces_from_outside(void **state)
{
    (void)state;
    struct sim_scene s = scene();
    struct sim_hit hit;
    assert_true(sim_arena_ray(&s, (struct sim_point){0.5, 0.8}, (struct sim_point){0.7, 0.8}, &hit));
    assert_near(hit.fraction, 0.5, 1e-12);
    assert_near(hit.normal.x, 1, 0);
    assert_true(sim_arena_ray(&s, (struct sim_point){0.7, 0.95}, (struct sim_point){0.7, 0.85}, &hit));
    assert_near(hit.fraction, 0.5, 1e-12);
    assert_near(hit.normal.y, -1, 0);
}

static void test_ray_meets_walls(void **state)
{
    (void)state;
    struct sim_scene s = scene();
    struct sim_hit hit;
    assert_true(sim_arena_ray(&s, (struct sim_point){0.1, 0.5}, (struct sim_point){-0.3, 0.5}, &hit));
    assert_near(hit.fraction, 0.25, 1e-12);
    assert_near(hit.normal.x, -1, 0);
    assert_true(sim_arena_ray(&s, (struct sim_point){0.2, 0.8}, (struct sim_point){0.3, 1.2}, &hit));
    assert_near(hit.fraction, 0.5, 1e-12);
    assert_near(hit.normal.y, 1, 0);
}

static void test_ray_passes_a_corner_or_cuts_it(void **state)
{
    (void)state;
    struct sim_scene s = scene();
    struct sim_hit hit;
    assert_false(sim_arena_ray(&s, (struct sim_point){0.55, 0.74}, (struct sim_point){0.64, 0.65}, &hit));
    assert_true(sim_arena_ray(&s, (struct sim_point){0.55, 0.76}, (struct sim_point){0.66, 0.65}, &hit));
    assert_false(sim_arena_ray(&s, (struct sim_point){0.55, 0.1}, (struct sim_point){0.55, 0.9}, &hit));
}

static void test_clearance(void **state)
{
    (void)state;
    struct sim_scene s = scene();
    assert_near(sim_arena_clearance(&s, (struct sim_point){0.3, 0.4}), 0.3, 1e-12);    /* left wall */
    assert_near(sim_arena_clearance(&s, (struct sim_point){0.57, 0.66}), 0.05, 1e-12); /* the box's corner */
    assert_near(sim_arena_clearance(&s, (struct sim_point){0.65, 0.8}), -0.05, 1e-12); /* inside the box */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_texture_under_a_point),
        cmocka_unit_test(test_nearest_tile_beyond_a_wall),
        cmocka_unit_test(test_distance_to_tile_border),
        cmocka_unit_test(test_ray_meets_faces_from_outside),
        cmocka_unit_test(test_ray_meets_walls),
        cmocka_unit_test(test_ray_passes_a_corner_or_cuts_it),
        cmocka_unit_test(test_clearance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
