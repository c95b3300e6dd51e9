/* The Gaussian of the adaptive filter: what speaks against it, when it may carry, and draws from it. */
#include "adaptive_gaussian.h"

#include "near.h"
#include "wander.h"

struct carried {
    struct wander w;
    struct nav_likelihood *likelihood;
    struct adaptive_gaussian g;
};

static void carried_begin(struct carried *c, double sigma)
{
    c->w = wander_new(3);
    c->w.problem.prior.sigma[0] = c->w.problem.prior.sigma[1] = sigma;
    const struct nav_problem *p = &c->w.problem;
    c->likelihood = nav_likelihood_new(&p->arena, &p->robot, &p->settings, 0.0);
    assert_int_equal(adaptive_gaussian_init(&c->g, p, c->likelihood), 0);
    c->g.carries = true;
}

static void carried_end(struct carried *c)
{
    adaptive_gaussian_free(&c->g);
    nav_likelihood_free(c->likelihood);
}

/* One row that the left floor whisker alone reads, certain of a class. */
static double carried_read(struct carried *c, int said)
{
    static const struct nav_pending STILL = {.step = {0.0, 0.0, 0.0}};
    double window[WANDER_CLASSES], weight[WANDER_TIPS + WANDER_RAYS] = {1.0};
    const double *reading[WANDER_TIPS + WANDER_RAYS] = {window};
    for (int k = 0; k < WANDER_CLASSES; k++)
        window[k] = k == said ? 0.0 : -20.0;
    const struct nav_evidence evidence = {.reading = reading, .weight = weight};
    nav_likelihood_read(c->likelihood, &evidence);
    return adaptive_gaussian_take(&c->g, &STILL, &evidence, 1.0);
}

static int carried_class(const struct carried *c)
{
    const struct nav_pose *m = &c->g.kalman.belief.mean;
    double s = sin(m->theta), o = cos(m->theta);
    return nav_arena_texture(&c->w.problem.arena, m->x + o * WANDER_TIP[0].x - s * WANDER_TIP[0].y,
                             m->y + s * WANDER_TIP[0].x + o * WANDER_TIP[0].y);
}

static void a_row_that_suits_all_of_it_reports_nothing(void **state)
{
    (void)state;
    struct carried c;
    carried_begin(&c, 0.001);
    double expected = carried_read(&c, carried_class(&c)), other = carried_read(&c, (carried_class(&c) + 1) % 3);
    assert_true(expected > 0.5 && other < -0.5);
    assert_near(c.g.reported, 0.0, 1e-9);
    assert_false(adaptive_gaussian_fails(&c.g));
    carried_end(&c);
}

static void rows_that_separate_its_parts_are_too_much_for_it(void **state)
{
    (void)state;
    struct carried c;
    carried_begin(&c, 0.15); /* some of it is on another tile */
    int rows = 0;
    for (; rows < 200 && c.g.reported <= 3.0; rows++)
        carried_read(&c, carried_class(&c));
    assert_in_range(rows, 2, 199);
    double reported = c.g.reported;
    adaptive_gaussian_begin(&c.g, &c.g.kalman.belief);
    assert_true(reported > 3.0 && c.g.reported == 0.0);
    carried_end(&c);
}

static void rows_that_only_a_wider_one_explains_speak_against_it(void **state)
{
    (void)state;
    struct carried c;
    carried_begin(&c, 0.004); /* the next tile is 14 mm off: reached by corners four times as far, not by its own */
    int said = (carried_class(&c) + 1) % 3, rows = 0;
    for (; rows < 100 && !adaptive_gaussian_fails(&c.g); rows++)
        carried_read(&c, said);
    assert_in_range(rows, 1, 99);
    assert_true(c.g.wider > 3.0 && c.g.reported < 3.0);
    carried_end(&c);
}

static void it_may_carry_when_it_has_long_reported_as_well_as_particles(void **state)
{
    (void)state;
    struct carried c;
    carried_begin(&c, 0.01);
    int rows = 1;
    c.g.compared = 1;
    while (!adaptive_gaussian_compare(&c.g, 0.01, 0.0) && rows < 1000)
        rows++;
    assert_in_range(rows, 64, 300);
    adaptive_gaussian_begin(&c.g, &c.g.kalman.belief);
    c.g.compared = 1;
    for (rows = 1; c.g.compared > 0; rows++)
        assert_false(adaptive_gaussian_compare(&c.g, 0.1, 0.0)); /* ten to one by every 23 rows */
    assert_in_range(rows, 10, 50);
    carried_end(&c);
}

static void draws_have_its_moments_and_more_of_them_are_wider(void **state)
{
    (void)state;
    enum { DRAWS = 4000 };
    struct carried c;
    struct nav_particles set;
    struct nav_rng rng;
    carried_begin(&c, 0.02);
    c.g.kalman.belief.covariance[1] = c.g.kalman.belief.covariance[3] = 0.0002;
    nav_rng_seed(&rng, 1, 0);
    assert_int_equal(nav_particles_init(&set, 5 * DRAWS, true, 0.0), 0);
    for (int wide = 0; wide < 2; wide++) {
        double covariance[9], scale = wide ? 16.0 : 1.0;
        c.g.wider = wide ? 100.0 : 0.0;
        adaptive_gaussian_draw(&c.g, &set, &rng, DRAWS);
        assert_int_equal(set.count, wide ? 4 * DRAWS : DRAWS);
        nav_particles_covariance(&set, &(struct nav_pending){.noise = {0.0, 0.0}}, c.g.kalman.belief.mean, covariance);
        for (int k = 0; k < 9; k++)
            assert_near(covariance[k], scale * c.g.kalman.belief.covariance[k], scale * 6e-5);
    }
    nav_particles_free(&set);
    carried_end(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_row_that_suits_all_of_it_reports_nothing),
        cmocka_unit_test(rows_that_separate_its_parts_are_too_much_for_it),
        cmocka_unit_test(rows_that_only_a_wider_one_explains_speak_against_it),
        cmocka_unit_test(it_may_carry_when_it_has_long_reported_as_well_as_particles),
        cmocka_unit_test(draws_have_its_moments_and_more_of_them_are_wider),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
