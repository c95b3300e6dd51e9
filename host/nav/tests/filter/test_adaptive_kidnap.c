/* The adaptive filter's test of a kidnap: what a robot anywhere would read, and that what a search finds is kept. */
#include "adaptive_kidnap.h"

#include "filter.h"
#include "near.h"
#include "wander.h"

enum { PRINTED = 30 };

/* Log-likelihood anywhere of a window of one tip that speaks for the first class. */
static double read_again(struct adaptive_kidnap *d, struct nav_likelihood *l, double moved)
{
    const double window[WANDER_CLASSES] = {log(0.8), log(0.1), log(0.1)}, nowhere = INFINITY;
    const double *reading[WANDER_TIPS + WANDER_RAYS] = {window, window, &nowhere, &nowhere, &nowhere};
    const double weight[WANDER_TIPS + WANDER_RAYS] = {1.0}, path[WANDER_TIPS + WANDER_RAYS] = {moved};
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = weight, .moved = path});
    return adaptive_kidnap_anywhere(d, l, path);
}

static void what_is_met_anywhere_stays_for_a_while(void **state)
{
    (void)state;
    struct wander w = wander_new(1);
    struct nav_rng rng;
    struct adaptive_kidnap d;
    struct nav_likelihood *l = nav_likelihood_new(&w.problem.arena, &w.problem.robot, &w.problem.settings, 0.0);
    nav_rng_seed(&rng, 1, 0);
    assert_int_equal(adaptive_kidnap_init(&d, l, &rng), 0);
    double first = read_again(&d, l, INFINITY);
    double again = read_again(&d, l, 0.0);
    double sum = 0.0, square = 0.0; /* the forward algorithm by hand, for a state that stays */
    for (int k = 0; k < WANDER_CLASSES; k++) {
        double p = d.trust[0] * l->ratio[0][k] + 1.0 - d.trust[0];
        sum += d.any[0].share[k] * p;
        square += d.any[0].share[k] * p * p;
    }
    assert_near(first, log(sum), 1e-6);
    assert_near(again, log(square / sum), 1e-6);
    assert_true(again > first + 0.2);
    assert_near(read_again(&d, l, 1e9), first, 1e-6); /* far off it is another draw */
    adaptive_kidnap_clear(&d, l, 1);
    assert_near(read_again(&d, l, 0.0), first, 1e-6); /* as in another place */
    adaptive_kidnap_free(&d);
    nav_likelihood_free(l);
}

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
        cmocka_unit_test(what_is_met_anywhere_stays_for_a_while),
        cmocka_unit_test(a_robot_carried_over_a_printed_floor_is_found_and_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
