/* The adaptive filter after a kidnap: what a search has found is kept, however full the cloud is. */
#include "filter.h"

#include "near.h"
#include "wander.h"

enum { PRINTED = 30 };

/* A floor of black and white cells of 5 cm, and no walls in reach: any place fits for a while. */
static struct wander printed(uint64_t seed, uint8_t floor[PRINTED * PRINTED])
{
    struct wander w = wander_new(seed);
    struct nav_rng rng;
    nav_rng_seed(&rng, seed, 9);
    for (int n = 0; n < PRINTED * PRINTED; n++)
        floor[n] = nav_rng_uniform(&rng) < 0.5;
    w.problem.arena = (struct nav_arena){.size_x = 1.5,
                                         .size_y = 1.5,
                                         .tile = 0.05,
                                         .columns = PRINTED,
                                         .rows = PRINTED,
                                         .floor = floor,
                                         .classes = WANDER_CLASSES};
    w.problem.robot.rays = 0;
    return w;
}

static void a_robot_carried_over_a_printed_floor_is_found_and_kept(void **state)
{
    (void)state;
    enum { SEEDS = 6, ROWS = 250, KEPT = 50 };
    int found = 0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        uint8_t floor[PRINTED * PRINTED];
        struct wander w = printed(seed, floor);
        w.problem.settings.adaptive.least = w.problem.settings.adaptive.most; /* a cloud that is always full */
        struct nav_filter *f = nav_filter_new("adaptive", &w.problem);
        struct nav_estimate e;
        for (int k = 0; k < 100; k++)
            nav_filter_step(f, wander_on(&w), &e);
        assert_true(wander_error(&w, &e) < 0.1);
        w.pose = (struct nav_pose){0.4, 1.0, 2.0};
        int near = 0;
        for (int k = 0; k < ROWS; k++) {
            nav_filter_step(f, wander_on(&w), &e);
            near = wander_error(&w, &e) < 0.1 ? near + 1 : 0;
        }
        found += near >= KEPT;
        nav_filter_free(f);
    }
    assert_int_equal(found, SEEDS);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_robot_carried_over_a_printed_floor_is_found_and_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
