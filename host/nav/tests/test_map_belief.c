/* What readings teach about the map: tiles, boxes that are gone, things that it lacks. */
#include "map_belief.h"

#include "likelihood.h"
#include "near.h"
#include "rooms.h"
#include "wander.h"

static const struct nav_place TILE = {0.2, 0.25, 1.0, 0.0}, BY_BOX = {0.6, 0.15, 1.0, 0.0}, OPEN = {0.3, 0.7, 1.0, 0.0};

static struct nav_likelihood *reported(void)
{
    static struct nav_problem p;
    p = room();
    return nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
}

/* A row: class said, and contact at a distance (NAN: not read). Its log-likelihood at the pose. */
static double read_at(struct nav_likelihood *l, const struct nav_place *at, int said, double distance)
{
    static double texture[2], contact;
    static const double *const reading[] = {texture, &contact};
    const double weight[] = {said >= 0, !isnan(distance)};
    texture[0] = said == 1 ? -10.0 : 0.0;
    texture[1] = said == 1 ? 0.0 : -10.0;
    contact = distance;
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = weight});
    return (double)nav_likelihood_at(l, at, l->scratch);
}

static double teach(struct nav_likelihood *l, const struct nav_place *at, int said, double distance, int rows)
{
    double last = 0.0;
    for (int n = 0; n < rows; n++) {
        last = read_at(l, at, said, distance);
        nav_trust_begin(l);
        nav_map_begin(l);
        nav_trust_add(l, l->scratch, 1.0);
        nav_map_add(l, at, l->scratch, 1.0);
        nav_map_learn(l);
    }
    return last;
}

static void a_tile_that_keeps_saying_otherwise_is_believed(void **state)
{
    (void)state;
    struct nav_likelihood *l = reported();
    double before = read_at(l, &TILE, 1, NAN);
    teach(l, &TILE, 1, NAN, 2);
    assert_near(read_at(l, &TILE, 1, NAN), before, 1e-6); /* two windows may err */
    teach(l, &TILE, 1, NAN, 10);
    assert_true(read_at(l, &TILE, 1, NAN) > 0.0 && read_at(l, &TILE, 0, NAN) < 0.0);
    teach(l, &TILE, 0, NAN, 10);
    assert_true(read_at(l, &TILE, 0, NAN) > 0.0); /* and it may have been a mistake */
    nav_likelihood_free(l);
}

static void a_tile_found_as_reported_is_harder_to_change(void **state)
{
    (void)state;
    struct nav_likelihood *l = reported();
    teach(l, &TILE, 0, NAN, 100);
    teach(l, &TILE, 1, NAN, 4);
    assert_true(read_at(l, &TILE, 1, NAN) < 0.0);
    teach(l, &TILE, 1, NAN, 10);
    assert_true(read_at(l, &TILE, 1, NAN) > 0.0);
    nav_likelihood_free(l);
}

static void a_box_where_nothing_is_felt_is_gone(void **state)
{
    (void)state;
    struct nav_likelihood *l = reported();
    double fits = read_at(l, &OPEN, -1, INFINITY);
    assert_true(teach(l, &BY_BOX, -1, INFINITY, 1) < -2.0);
    assert_false(nav_likelihood_clear(l, 0.9, 0.1, 0.0));
    teach(l, &BY_BOX, -1, INFINITY, 5);
    assert_near(read_at(l, &BY_BOX, -1, INFINITY), fits, 1e-6);
    assert_true(nav_likelihood_clear(l, 0.9, 0.1, 0.0));
    nav_map_forget(l);
    assert_true(read_at(l, &BY_BOX, -1, INFINITY) < -2.0);
    assert_false(nav_likelihood_clear(l, 0.9, 0.1, 0.0));
    nav_likelihood_free(l);
}

static void a_box_that_is_felt_stays(void **state)
{
    (void)state;
    struct nav_likelihood *l = reported();
    teach(l, &BY_BOX, -1, 0.15, 5); /* its face is 0.15 m from the whisker's base */
    teach(l, &BY_BOX, -1, INFINITY, 2);
    teach(l, &BY_BOX, -1, 0.05, 20); /* what stands before it says nothing of it */
    assert_false(nav_likelihood_clear(l, 0.9, 0.1, 0.0));
    nav_likelihood_free(l);
}

static void contacts_with_what_the_map_lacks_are_expected_at_last(void **state)
{
    (void)state;
    struct nav_likelihood *l = reported();
    double ghost = teach(l, &OPEN, -1, 0.1, 1);
    assert_true(ghost < -4.0);
    assert_near(read_at(l, &OPEN, -1, 0.1), ghost, 1e-6); /* one may be a ghost */
    teach(l, &OPEN, -1, 0.1, 2);
    assert_near(read_at(l, &OPEN, -1, 0.1), 0.0, 1e-6);
    assert_near(read_at(l, &TILE, -1, 0.1), ghost, 1e-6); /* not at other places */
    teach(l, &OPEN, -1, INFINITY, 3);                     /* nothing is felt where it was */
    assert_near(read_at(l, &OPEN, -1, 0.1), ghost, 1e-6);
    nav_likelihood_free(l);
}

static void what_was_learned_where_the_robot_was_not_is_forgotten(void **state)
{
    (void)state;
    struct nav_likelihood *l = reported();
    double before = read_at(l, &OPEN, 0, 0.1);
    teach(l, &OPEN, 0, 0.1, 20);
    assert_true(read_at(l, &OPEN, 0, 0.1) > before + 4.0);
    nav_map_forget(l);
    assert_near(read_at(l, &OPEN, 0, 0.1), before, 1e-6);
    nav_likelihood_free(l);
}

/* Worlds that differ from the map: a tile, no box, a box at another place. */
static const uint8_t WRONG_FLOOR[] = {0, 1, 2, 2, 1, 1, 1, 2, 0, 2, 1, 0, 1, 1, 2, 0};
static const struct nav_box MOVED[] = {{0.3, 1.0, 0.7, 1.3}};

static void change(struct nav_arena *arena, int kind)
{
    if (kind == 0)
        arena->floor = WRONG_FLOOR;
    else if (kind == 1)
        arena->boxes = 0;
    else
        arena->box = MOVED;
}

/* Whether the robot is near at the end of so many rows in a world that differs from the map, carried before the last
 * `after` of them, 0: never. */
static bool near_at_end(int kind, uint64_t seed, long rows, long after)
{
    struct wander w = wander_new(seed);
    struct nav_filter *f = nav_filter_new("adaptive", &w.problem);
    struct nav_estimate e = {.confidence = 0.0};
    change(&w.problem.arena, kind);
    for (long k = rows; k > 0; k--) {
        if (k == after)
            w.pose = (struct nav_pose){1.6, 0.4, 2.0};
        nav_filter_step(f, wander_on(&w), &e);
    }
    nav_filter_free(f);
    return wander_error(&w, &e) < 0.1;
}

static void the_adaptive_filter_keeps_its_place_in_a_wrong_map(void **state)
{
    (void)state;
    int near = 0;
    for (int kind = 0; kind < 3; kind++) {
        for (uint64_t seed = 1; seed <= 10; seed++)
            near += near_at_end(kind, seed, 600, 0);
    }
    assert_true(near >= 29);
}

static void and_finds_a_robot_that_was_carried_in_one(void **state)
{
    (void)state;
    int near = 0;
    for (int kind = 1; kind < 3; kind++) {
        for (uint64_t seed = 11; seed <= 20; seed++)
            near += near_at_end(kind, seed, 900, 600);
    }
    assert_true(near >= 19);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_tile_that_keeps_saying_otherwise_is_believed),
        cmocka_unit_test(a_tile_found_as_reported_is_harder_to_change),
        cmocka_unit_test(a_box_where_nothing_is_felt_is_gone),
        cmocka_unit_test(a_box_that_is_felt_stays),
        cmocka_unit_test(contacts_with_what_the_map_lacks_are_expected_at_last),
        cmocka_unit_test(what_was_learned_where_the_robot_was_not_is_forgotten),
        cmocka_unit_test(the_adaptive_filter_keeps_its_place_in_a_wrong_map),
        cmocka_unit_test(and_finds_a_robot_that_was_carried_in_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
