/* Particles by hand and against the grid; the filter's state is looked at, so its source is part of this program. */
#include "../filter/particle.c"

#include <string.h>

#include "near.h"
#include "rooms.h"
#include "wander.h"

static const double BOTH[] = {1.0, 1.0};

static void resampling_takes_each_by_its_share(void **state)
{
    (void)state;
    struct nav_particles p;
    assert_int_equal(nav_particles_init(&p, 10, true, 0.1), 0);
    const float weight[] = {0.5f, 0.0f, 0.2f, 0.3f};
    double taken[4] = {0.0};
    for (int n = 0; n < 1000; n++) {
        p.count = 4;
        for (int i = 0; i < 4; i++) {
            p.x[i] = p.mode[i] = (float)i;
            p.weight[i] = weight[i];
        }
        nav_particles_resample(&p, 7, (n + 0.5) / 1000.0);
        int now[4] = {0};
        for (int k = 0; k < 7; k++) {
            now[(int)p.x[k]]++;
            assert_near((double)p.mode[k], (double)p.x[k], 0.0); /* all that a particle holds goes with it */
        }
        for (int i = 0; i < 4; i++) {
            assert_true(fabs(now[i] - 7.0 * (double)weight[i]) < 1.0); /* systematic: never off by a whole one */
            taken[i] += now[i] / 7000.0;
        }
        assert_near((double)p.weight[0], 1.0 / 7.0, 1e-7);
    }
    for (int i = 0; i < 4; i++)
        assert_near(taken[i], (double)weight[i], 1e-3); /* and right on average */
    nav_particles_free(&p);
}

static void the_bound_is_foxs(void **state)
{
    (void)state;
    assert_near(nav_bins_bound(1.0, 0.05), 1.0, 0.0);
    /* 2 bins: chi-square with one degree of freedom at 99 % is 6.63; Wilson and Hilferty make it 6.58. */
    assert_near(nav_bins_bound(2.0, 0.05) * 2.0 * 0.05, 6.58, 0.01);
    /* 101 bins: 135.8 in tables. */
    assert_near(nav_bins_bound(101.0, 0.05) * 2.0 * 0.05, 135.8, 0.1);
}

static struct nav_problem quiet(void)
{
    struct nav_problem p = room();
    p.settings.particle.recovery = 0.0;
    p.seed = 7;
    return p;
}

static void a_wider_belief_takes_more_particles(void **state)
{
    (void)state;
    struct nav_problem p = quiet();
    long count[3];
    for (int n = 0; n < 3; n++) {
        p.prior.sigma[0] = p.prior.sigma[1] = n == 0 ? 0.002 : 0.05;
        p.prior.sigma[2] = n == 0 ? 0.002 : 0.2;
        p.prior.uniform = n == 2;
        struct particle *f = particle_create(&p);
        count[n] = f->cloud.count;
        particle_destroy(f);
    }
    assert_int_equal(count[0], 300);
    assert_true(count[1] > 2 * count[0] && count[1] < 5000);
    assert_true(count[2] > 10000 && count[2] <= 20000);
    p.settings.particle.count = 1234.0;
    struct particle *f = particle_create(&p);
    assert_int_equal(f->cloud.count, 1234);
    particle_destroy(f);
}

static void standing_weighs_as_the_codes_do_where_the_robot_can_stand(void **state)
{
    (void)state;
    struct nav_problem p = room();
    const struct nav_ray aslant = {0.05, 0.02, 0.6, 0.2};
    p.robot.ray = &aslant;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    struct nav_rng rng;
    nav_rng_seed(&rng, 3, 0);
    const double texture[] = {0.0, -3.0}, distance = 0.12, nothing = INFINITY;
    const double weights[][2] = {{1.0, 1.0}, {0.5, 0.0}, {0.0, 0.5}, {1.0, 1.0}};
    int blocked = 0;
    for (int n = 0; n < 4000; n++) {
        const double *reading[] = {texture, n % 4 == 3 ? &nothing : &distance};
        nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = weights[n % 4]});
        struct nav_pose at = {1.2 * nav_rng_uniform(&rng) - 0.1, 1.2 * nav_rng_uniform(&rng) - 0.1,
                              7.0 * nav_rng_uniform(&rng)};
        const struct nav_place place = {at.x, at.y, cos(at.theta), sin(at.theta)};
        double said = nav_likelihood_standing(l, &place);
        uint8_t codes[2];
        nav_likelihood_expect(l, &place, codes);
        if (nav_arena_free(&p.arena, at.x, at.y, p.robot.body_radius)) {
            assert_near(said, (double)summed(l, codes), 1e-5);
            assert_true(said <= l->ceiling + 1e-9);
        } else {
            assert_true(isinf(said) && said < 0.0);
            blocked++;
        }
    }
    assert_in_range(blocked, 500, 2500);
    nav_likelihood_free(l);
}

static void a_move_is_the_motions_and_its_noise(void **state)
{
    (void)state;
    enum { N = 20000 };
    struct nav_particles p;
    struct nav_rng rng;
    assert_int_equal(nav_particles_init(&p, N, false, 0.0), 0);
    nav_rng_seed(&rng, 1, 0);
    p.count = N;
    for (long i = 0; i < N; i++) {
        nav_particles_set(&p, i, (struct nav_pose){1.0, 2.0, NAV_PI / 6.0});
        p.weight[i] = 1.0f / N;
    }
    nav_particles_move(&p, (struct nav_pose){0.3, 0.1, 0.5}, &(struct nav_noise){0.0004, 0.09}, true, &rng);
    struct nav_pose mean, expected = {1.0 + 0.3 * sqrt(0.75) - 0.1 * 0.5, 2.0 + 0.3 * 0.5 + 0.1 * sqrt(0.75), 0.0};
    expected.theta = NAV_PI / 6.0 + 0.5;
    double c[9];
    nav_particles_near(&p, expected, &mean);
    assert_near(mean.x, expected.x, 1e-3);
    assert_near(mean.y, expected.y, 1e-3);
    assert_near(mean.theta, expected.theta, 1e-2);
    nav_particles_covariance(&p, &(struct nav_pending){.noise = {0.0, 0.0}}, mean, c);
    assert_near(c[0], 0.0004, 2e-5);
    assert_near(c[4], 0.0004, 2e-5);
    assert_near(c[8], 0.09, 3e-3);
    for (long i = 0; i < N; i += 100)
        assert_near((double)(p.c[i] * p.c[i] + p.s[i] * p.s[i]), 1.0, 1e-5);
    nav_particles_free(&p);
}

/* One row of a robot that drives a bend. */
static void step(struct nav_filter *f, int number, struct nav_estimate *e)
{
    static const double TEXTURE[] = {0.0, -3.0}, NOTHING = INFINITY;
    struct nav_row row = {.t_s = 0.1 * number, .odometry = {0.03, 0.0, 0.1}, .texture = TEXTURE, .radial_m = &NOTHING};
    nav_filter_step(f, &row, e);
}

enum { ROOM_FOR = 400000, BINS = 4 * 4 * 12 };

/* Masses by where a component lies, 25 cm x 25 cm x 30 degrees: whole cells of the grid below. */
static void into_bins(const struct nav_component *list, long count, double bins[BINS])
{
    memset(bins, 0, BINS * sizeof *bins);
    for (long n = 0; n < count; n++) {
        struct nav_pose at = list[n].pose;
        int heading = (int)((nav_wrap(at.theta) + NAV_PI) / (NAV_PI / 6.0)) % 12;
        bins[((int)(at.x / 0.25) + 4 * (int)(at.y / 0.25)) * 12 + heading] += list[n].mass;
    }
}

/* Belief after six rows, in coarse bins. */
static void believe(const struct nav_problem *p, const char *name, struct nav_component *list, double bins[BINS])
{
    struct nav_filter *f = nav_filter_new(name, p);
    struct nav_estimate e;
    for (int n = 0; n < 6; n++)
        step(f, n, &e);
    long count = nav_filter_components(f, list, ROOM_FOR);
    assert_in_range(count, 2, ROOM_FOR);
    into_bins(list, count, bins);
    nav_filter_free(f);
}

static void many_particles_come_to_the_exact_posterior(void **state)
{
    (void)state;
    struct nav_problem p = quiet();
    p.prior.uniform = true;
    p.settings.particle.count = 100000.0;
    p.settings.grid.cell_m = 0.025;
    p.settings.grid.cell_deg = 5.0;
    p.settings.motion.hazard = 0.0;
    struct nav_component *list = calloc(ROOM_FOR, sizeof *list);
    double grid[BINS], many[BINS], few[BINS], off_many = 0.0, off_few = 0.0;
    believe(&p, "grid", list, grid);
    believe(&p, "particle", list, many);
    p.settings.particle.count = 100.0;
    believe(&p, "particle", list, few);
    for (int n = 0; n < BINS; n++) {
        off_many += 0.5 * fabs(many[n] - grid[n]);
        off_few += 0.5 * fabs(few[n] - grid[n]);
    }
    assert_near(off_many, 0.0, 0.04);
    assert_true(off_few > 3.0 * off_many);
    free(list);
}

static void two_particles_follow_a_robot_that_they_know(void **state)
{
    (void)state;
    struct nav_problem p = quiet();
    p.settings.particle.count = 2.0;
    p.prior.mean = (struct nav_pose){0.25, 0.25, 0.0};
    p.prior.sigma[0] = p.prior.sigma[1] = p.prior.sigma[2] = 0.001;
    p.robot.odometry_relative = 0.01;
    struct nav_filter *f = nav_filter_new("particle", &p);
    struct nav_estimate e;
    struct nav_pose truth = p.prior.mean;
    for (int n = 0; n < 20; n++) {
        step(f, n, &e);
        truth = nav_compose(truth, (struct nav_pose){0.03, 0.0, 0.1});
        assert_int_equal(e.states, 2);
        assert_int_equal(e.evaluations, 2);
    }
    assert_near(hypot(e.pose.x - truth.x, e.pose.y - truth.y), 0.0, 0.03);
    nav_filter_free(f);
}

static void the_same_seed_gives_the_same_bytes(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_estimate e[3];
    for (int n = 0; n < 3; n++) {
        p.seed = n == 2 ? 8 : 7;
        struct nav_filter *f = nav_filter_new("particle", &p);
        for (int i = 0; i < 30; i++)
            step(f, i, &e[n]);
        nav_filter_free(f);
    }
    assert_memory_equal(&e[0].pose, &e[1].pose, sizeof e[0].pose);
    assert_memory_not_equal(&e[0].pose, &e[2].pose, sizeof e[0].pose);
}

/* One row whose readings fit with nothing: the tip on the other texture, a contact in the open. */
static void contradict(struct particle *f, double distance)
{
    const double texture[] = {-50.0, 0.0};
    const double *reading[] = {texture, &distance};
    particle_predict(f, &(struct nav_motion){.unknown_m = 0.0});
    particle_update(f, &(struct nav_evidence){.reading = reading, .weight = BOTH});
}

static void weights_that_stay_low_bring_fresh_particles_where_the_row_fits(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.settings.particle.count = 2000.0;
    p.prior.mean = (struct nav_pose){0.25, 0.25, 0.0}; /* texture 0, nothing within reach */
    p.prior.sigma[0] = p.prior.sigma[1] = p.prior.sigma[2] = 0.02;
    struct particle *f = particle_create(&p);
    const double texture[] = {0.0, -50.0}, nothing = INFINITY;
    const double *fits[] = {texture, &nothing};
    for (int n = 0; n < 50; n++) {
        particle_predict(f, &(struct nav_motion){.unknown_m = 0.0});
        particle_update(f, &(struct nav_evidence){.reading = fits, .weight = BOTH});
        assert_int_equal(f->weighed, 2000); /* none injected */
    }
    double before = f->slow;
    assert_true(before > 0.2);
    for (int n = 0; n < 40; n++)
        contradict(f, 0.1);
    assert_true(f->fast > 0.5 * before); /* those injected have taken over, and they fit */
    long apart = 0;
    for (long i = 0; i < f->cloud.count; i++)
        apart += hypot((double)f->cloud.x[i] - 0.25, (double)f->cloud.y[i] - 0.25) > 0.2;
    assert_true(apart > 1800);
    particle_destroy(f);
}

static void the_work_reported_counts_particles_weighed_and_particles_moved(void **state)
{
    (void)state;
    struct nav_problem p = quiet();
    p.settings.particle.count = 100.0;
    struct particle *f = particle_create(&p);
    struct nav_estimate e;
    const double texture[] = {0.0, -1.0}, nothing = INFINITY, none[] = {0.0, 0.0};
    const double *reading[] = {texture, &nothing};
    particle_predict(f, &(struct nav_motion){.step = {0.01, 0.0, 0.0}});
    particle_estimate(f, &e);
    assert_int_equal(e.touched, 0); /* put off */
    particle_update(f, &(struct nav_evidence){.reading = reading, .weight = none});
    particle_estimate(f, &e);
    assert_int_equal(e.evaluations, 100);
    assert_int_equal(e.touched, 200);
    particle_predict(f, &(struct nav_motion){.step = {0.1, 0.0, 0.0}}); /* too far to be put off */
    particle_estimate(f, &e);
    assert_int_equal(e.evaluations, 0);
    assert_int_equal(e.touched, 100);
    particle_destroy(f);
}

/* Every second of a tight cloud gives way, counted from a place that the random numbers choose: here the first, where
 * the place after the last one would be the next in turn. */
static void fresh_particles_take_their_share_of_the_places_and_none_beyond(void **state)
{
    (void)state;
    struct nav_problem p = quiet();
    p.settings.particle.count = 300.0;
    p.prior.sigma[0] = p.prior.sigma[1] = p.prior.sigma[2] = 0.002;
    struct particle *f = particle_create(&p);
    f->rng = (struct nav_rng){{0, 5, 7, 5}}; /* its second uniform number is 0 */
    particle_resample(f, 0.5);
    assert_int_equal(f->cloud.count, 300);
    for (long i = 0; i < 300; i++) {
        double x = (double)f->cloud.x[i], y = (double)f->cloud.y[i];
        assert_near(hypot((double)f->cloud.c[i], (double)f->cloud.s[i]), 1.0, 1e-6);
        assert_true(nav_arena_free(&p.arena, x, y, p.robot.body_radius));
        if (i % 2)
            assert_near(hypot(x - 0.5, y - 0.5), 0.0, 0.02);
    }
    particle_destroy(f);
}

static void weights_never_become_more_uneven_than_allowed(void **state)
{
    (void)state;
    struct nav_problem p = quiet();
    p.prior.uniform = true;
    struct particle *f = particle_create(&p);
    const double texture[] = {0.0, -50.0}, nothing = INFINITY;
    const double *reading[] = {texture, &nothing};
    for (int n = 0; n < 30; n++) {
        particle_predict(f, &(struct nav_motion){.step = {0.02, 0.0, 0.1}});
        particle_update(f, &(struct nav_evidence){.reading = reading, .weight = BOTH});
        assert_true(nav_particles_effective(&f->cloud) >= 0.5 * (double)f->cloud.count);
    }
    assert_true(f->cloud.count < 10000); /* half the room has been ruled out: fewer are needed */
    particle_destroy(f);
}

static void a_row_that_no_particle_can_explain_changes_no_weight(void **state)
{
    (void)state;
    struct nav_problem p = quiet();
    p.settings.particle.count = 50.0;
    struct particle *f = particle_create(&p);
    for (long i = 0; i < 50; i++)
        nav_particles_set(&f->cloud, i, (struct nav_pose){5.0, 5.0, 0.0});
    contradict(f, 0.1);
    double total = 0.0;
    for (long i = 0; i < 50; i++)
        total += (double)f->cloud.weight[i];
    assert_near(total, 1.0, 1e-5);
    assert_int_equal(f->cloud.count, 50);
    particle_destroy(f);
}

/* Two clouds 0.6 m apart are two modes, whose masses follow the weights. */
static void two_places_are_two_modes(void **state)
{
    (void)state;
    enum { EACH = 400 };
    struct nav_particles set;
    struct nav_rng rng;
    nav_rng_seed(&rng, 5, 0);
    assert_int_equal(nav_particles_init(&set, 2 * EACH, true, 0.0), 0);
    for (int i = 0; i < 2 * EACH; i++) {
        double x = 0.03 * nav_rng_normal(&rng), y = 0.01 * nav_rng_normal(&rng);
        struct nav_pose at = {(i % 2 ? 0.8 : 0.2) + x, 0.6 + y, 3.1 + 0.1 * nav_rng_normal(&rng)};
        nav_particles_add(&set, at, (i % 2 ? 0.3 : 0.7) / EACH, &rng);
    }
    struct nav_mode found[NAV_MODES_MOST];
    double mass[2];
    assert_int_equal(nav_particles_modes(&set, found), 2);
    nav_particles_masses(&set, mass, 2);
    for (int m = 0; m < 2; m++) {
        bool left = found[m].mean.x < 0.5;
        assert_near(found[m].mean.x, left ? 0.2 : 0.8, 0.006);
        assert_near(mass[m], left ? 0.7 : 0.3, 1e-5);
    }
    const double one[] = {1e30, 0.0}, none[] = {0.0, 0.0};
    for (int n = 0; n < 2; n++) { /* the second time nothing would be left: it stays */
        nav_particles_weigh_modes(&set, n == 0 ? one : none, 2);
        nav_particles_masses(&set, mass, 2);
        assert_near(mass[0], 1.0, 1e-5);
        assert_near(mass[1], 0.0, 0.0);
    }
    nav_particles_free(&set);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(resampling_takes_each_by_its_share),
        cmocka_unit_test(the_bound_is_foxs),
        cmocka_unit_test(a_wider_belief_takes_more_particles),
        cmocka_unit_test(standing_weighs_as_the_codes_do_where_the_robot_can_stand),
        cmocka_unit_test(a_move_is_the_motions_and_its_noise),
        cmocka_unit_test(many_particles_come_to_the_exact_posterior),
        cmocka_unit_test(two_particles_follow_a_robot_that_they_know),
        cmocka_unit_test(the_same_seed_gives_the_same_bytes),
        cmocka_unit_test(weights_that_stay_low_bring_fresh_particles_where_the_row_fits),
        cmocka_unit_test(the_work_reported_counts_particles_weighed_and_particles_moved),
        cmocka_unit_test(fresh_particles_take_their_share_of_the_places_and_none_beyond),
        cmocka_unit_test(weights_never_become_more_uneven_than_allowed),
        cmocka_unit_test(a_row_that_no_particle_can_explain_changes_no_weight),
        cmocka_unit_test(two_places_are_two_modes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
