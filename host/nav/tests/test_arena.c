#include "arena.h"

#include "near.h"
#include "rooms.h"

static const double RIGHT = 0.0, UP = NAV_PI / 2.0, LEFT = NAV_PI, DOWN = -NAV_PI / 2.0;

static void texture_is_that_of_the_tile_or_of_the_nearest(void **state)
{
    (void)state;
    const struct nav_arena a = room().arena;
    assert_int_equal(nav_arena_texture(&a, 0.1, 0.1), 0);
    assert_int_equal(nav_arena_texture(&a, 0.6, 0.1), 1);
    assert_int_equal(nav_arena_texture(&a, 0.1, 0.6), 1);
    assert_int_equal(nav_arena_texture(&a, 0.9, 0.1), 1); /* over the box: the tile beneath */
    assert_int_equal(nav_arena_texture(&a, -3.0, 0.1), 0);
    assert_int_equal(nav_arena_texture(&a, 9.0, 9.0), 0);
    assert_int_equal(nav_arena_texture(&a, 9.0, -9.0), 1);
}

static void floors_need_not_be_square(void **state)
{
    (void)state;
    const uint8_t floor[] = {0, 1, 2, 3, 4, 5};
    const struct nav_arena a = {.size_x = 3.0, .size_y = 2.0, .tile = 1.0, .columns = 3, .rows = 2, .floor = floor};
    assert_int_equal(nav_arena_texture(&a, 2.5, 0.5), 2);
    assert_int_equal(nav_arena_texture(&a, 0.5, 1.5), 3);
    assert_int_equal(nav_arena_texture(&a, 9.0, 9.0), 5);
}

static void range_is_the_distance_to_the_first_wall_or_box(void **state)
{
    (void)state;
    const struct nav_arena a = room().arena;
    assert_near(nav_arena_range(&a, 0.3, 0.6, RIGHT, 1.0), 0.7, 1e-12);
    assert_near(nav_arena_range(&a, 0.3, 0.6, LEFT, 1.0), 0.3, 1e-12);
    assert_near(nav_arena_range(&a, 0.3, 0.2, RIGHT, 1.0), 0.5, 1e-12);
    assert_near(nav_arena_range(&a, 0.9, 0.6, DOWN, 1.0), 0.3, 1e-12);
    assert_near(nav_arena_range(&a, 0.9, 0.6, UP, 1.0), 0.4, 1e-12);
    /* A 45 degree ray: from (0.6, 0.1) it meets the box's side x = 0.8 at y = 0.3, its corner. */
    assert_near(nav_arena_range(&a, 0.6, 0.05, NAV_PI / 4.0, 1.0), 0.2 * sqrt(2.0), 1e-12);
    /* And from a little higher it passes over it to the wall x = 1 at y = 0.55. */
    assert_near(nav_arena_range(&a, 0.6, 0.15, NAV_PI / 4.0, 1.0), 0.4 * sqrt(2.0), 1e-12);
}

static void nothing_within_reach_is_infinite_and_inside_a_solid_is_zero(void **state)
{
    (void)state;
    const struct nav_arena a = room().arena;
    assert_true(isinf(nav_arena_range(&a, 0.3, 0.6, RIGHT, 0.69)));
    assert_near(nav_arena_range(&a, 0.3, 0.6, RIGHT, 0.71), 0.7, 1e-12);
    assert_near(nav_arena_range(&a, 0.9, 0.1, UP, 0.2), 0.0, 0.0);
    assert_near(nav_arena_range(&a, 1.2, 0.1, LEFT, 0.2), 0.0, 0.0);
}

static void free_space_keeps_the_body_clear(void **state)
{
    (void)state;
    const struct nav_arena a = room().arena;
    assert_true(nav_arena_free(&a, 0.5, 0.5, 0.05));
    assert_false(nav_arena_free(&a, 0.04, 0.5, 0.05));
    assert_false(nav_arena_free(&a, 0.5, 0.97, 0.05));
    assert_false(nav_arena_free(&a, 0.9, 0.34, 0.05));
    assert_true(nav_arena_free(&a, 0.9, 0.36, 0.05));
    /* Off a corner the body's roundness counts: (0.77, 0.34) is exactly 0.05 from (0.8, 0.3). */
    assert_true(nav_arena_free(&a, 0.7699, 0.3401, 0.05));
    assert_false(nav_arena_free(&a, 0.7701, 0.3399, 0.05));
    assert_false(nav_arena_free(&a, NAN, 0.5, 0.05));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texture_is_that_of_the_tile_or_of_the_nearest),
        cmocka_unit_test(floors_need_not_be_square),
        cmocka_unit_test(range_is_the_distance_to_the_first_wall_or_box),
        cmocka_unit_test(nothing_within_reach_is_infinite_and_inside_a_solid_is_zero),
        cmocka_unit_test(free_space_keeps_the_body_clear),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
