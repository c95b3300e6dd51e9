#include "expected.h"
#include "likelihood.h"
#include "measurement.h"

#include "near.h"
#include "rooms.h"

static struct nav_settings settings(void)
{
    struct nav_settings s;
    nav_settings_default(&s);
    s.texture_temper = 0.05;
    s.texture_outlier = 0.2;
    s.radial_miss = 0.1;
    s.radial_ghost = 0.01;
    return s;
}

static void texture_is_tempered_and_floored(void **state)
{
    (void)state;
    struct nav_settings s = settings();
    struct nav_model m = {.fill = nav_mm_texture, .settings = &s, .values = 2, .codes = 2};
    nav_mm_texture_begin(&m);
    const double loglik[] = {-500.0, -520.0};
    double out[2];
    m.fill(&m, loglik, out);
    /* softmax(0, -1) = 0.7310586, 0.2689414; p = 0.8 share + 0.1; a broken whisker would say either with 1/2. */
    assert_near(out[0], 2.0 * (0.8 * 0.7310586 + 0.1), 1e-6);
    assert_near(out[1], 2.0 * (0.8 * 0.2689414 + 0.1), 1e-6);
}

static void however_sure_a_window_is_the_floor_remains(void **state)
{
    (void)state;
    struct nav_settings s = settings();
    struct nav_model m = {.fill = nav_mm_texture, .settings = &s, .values = 3, .codes = 3};
    nav_mm_texture_begin(&m);
    for (int sure = 0; sure < 3; sure++) {
        double loglik[] = {-1e6, -1e6, -1e6}, out[3];
        loglik[sure] = 0.0;
        m.fill(&m, loglik, out);
        for (int k = 0; k < 3; k++)
            assert_near(out[k], k == sure ? 3.0 * 0.8 + 0.2 : 0.2, 1e-6);
    }
}

/* A whisker of 0.1 m in steps of 1 cm up to 0.12 m, code 12: nothing. */
static struct nav_model whisker(const struct nav_settings *s, double noticed[13])
{
    struct nav_model m = {.fill = nav_mm_radial,
                          .settings = s,
                          .values = 1,
                          .codes = 13,
                          .length = 0.1,
                          .step = 0.01,
                          .sigma = 0.01,
                          .edge = 0.01,
                          .noticed = noticed};
    nav_mm_radial_begin(&m);
    return m;
}

static void a_measured_distance_is_gaussian_on_a_floor_of_ghosts(void **state)
{
    (void)state;
    struct nav_settings s = settings();
    double noticed[13];
    const struct nav_model m = whisker(&s, noticed);
    const double reading = 0.045, peak = 1.0 / (0.01 * sqrt(2.0 * NAV_PI)), ghost = 0.01, length = 0.1;
    double out[13];
    m.fill(&m, &reading, out);
    assert_near(out[4], length * 0.9 * peak + 0.1 * ghost, 1e-4);
    assert_near(out[6], length * 0.9 * 0.9997674 * peak * exp(-2.0) + 0.1 * ghost, 1e-4);
    assert_near(out[12], ghost, 1e-5);
}

static void no_contact_is_strong_evidence_deep_in_a_wall_and_weak_at_the_tip(void **state)
{
    (void)state;
    struct nav_settings s = settings();
    double noticed[13];
    const struct nav_model m = whisker(&s, noticed);
    const double nothing = (double)INFINITY;
    double out[13];
    m.fill(&m, &nothing, out);
    assert_near(out[4], (1.0 - 0.9) * 0.99, 1e-4);
    assert_near(out[12], 0.99, 1e-5);
    /* Codes 9 and 10 lie half a step on either side of the tip: noticed with 0.9 Phi(+-0.5). */
    assert_near(out[9], (1.0 - 0.9 * 0.6914625) * 0.99, 1e-5);
    assert_near(out[10], (1.0 - 0.9 * 0.3085375) * 0.99, 1e-5);
}

static void whiskers_turn_with_the_robot(void **state)
{
    (void)state;
    struct nav_problem p = room();
    const struct nav_tip tip = {0.1, 0.2};
    const struct nav_ray ray = {0.05, 0.1, NAV_PI / 2.0, 0.2};
    p.robot.tip = &tip;
    p.robot.ray = &ray;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    uint8_t codes[2];
    nav_likelihood_expect(l, &p.arena, &p.robot, (struct nav_pose){0.2, 0.4, 0.0}, codes);
    assert_int_equal(codes[0], 1);
    /* Facing up at (0.4, 0.4): the tip is at (0.2, 0.5+), on tile 1; the ray starts at (0.3, 0.45) and points left. */
    nav_likelihood_expect(l, &p.arena, &p.robot, (struct nav_pose){0.4, 0.405, NAV_PI / 2.0}, codes);
    assert_int_equal(codes[0], 1);
    assert_int_equal(codes[1], l->model[1].codes - 1);
    /* Facing up at (0.2503, 0.4): the ray starts at 0.1503 and meets the wall after as much. */
    nav_likelihood_expect(l, &p.arena, &p.robot, (struct nav_pose){0.2503, 0.38, NAV_PI / 2.0}, codes);
    assert_int_equal(codes[0], 0);
    assert_int_equal(codes[1], (int)floor(0.1503 / l->model[1].step));
    nav_likelihood_free(l);
}

static void whiskers_add_and_those_not_read_say_nothing(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    const double texture[] = {0.0, -20.0}, distance = 0.1;
    const double *reading[] = {texture, &distance};
    const double both[] = {1.0, 1.0}, one[] = {1.0, 0.0}, none[] = {0.0, 0.0};
    uint8_t codes[2];
    nav_likelihood_expect(l, &p.arena, &p.robot, (struct nav_pose){0.8503, 0.6, 0.0}, codes);
    assert_int_equal(codes[0], 0);
    assert_int_equal(codes[1], (int)floor(0.0997 / l->model[1].step));
    nav_likelihood_read(l, &(struct nav_evidence){reading, both});
    float all = nav_likelihood_of(l, codes);
    nav_likelihood_read(l, &(struct nav_evidence){reading, one});
    float texture_only = nav_likelihood_of(l, codes);
    double ratio[256];
    l->model[1].fill(&l->model[1], &distance, ratio);
    double trust = l->trust[1].working, radial = log(trust * ratio[codes[1]] + 1.0 - trust);
    assert_near((double)all, (double)texture_only + radial, 1e-5);
    const double half[] = {0.0, 0.5};
    nav_likelihood_read(l, &(struct nav_evidence){reading, half});
    assert_near((double)nav_likelihood_of(l, codes), 0.5 * radial, 1e-5);
    nav_likelihood_read(l, &(struct nav_evidence){reading, none});
    assert_near((double)nav_likelihood_of(l, codes), 0.0, 0.0);
    nav_likelihood_free(l);
}

/* Expected distances are rounded to codes, of which a byte holds 256: finer than what a contact can tell. */
static void codes_of_a_distance_are_finer_than_its_noise_and_reach_the_tip(void **state)
{
    (void)state;
    static const double sigmas[] = {0.004, 0.01, 0.05}, lengths[] = {0.05, 0.2, 0.4};
    for (int n = 0; n < 9; n++) {
        struct nav_problem p = room();
        struct nav_ray ray = ROOM_RAY[0];
        ray.length = lengths[n / 3];
        p.robot.ray = &ray;
        p.robot.radial_sigma = sigmas[n % 3];
        struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
        assert_true(l->model[1].step <= sigmas[n % 3] / 2.0);
        assert_true((l->model[1].codes - 1) * l->model[1].step >= ray.length);
        assert_in_range(l->model[1].codes, 2, 256);
        nav_likelihood_free(l);
    }
}

static void the_table_holds_what_each_free_pose_expects(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.robot.body_radius = 0.06; /* half a step of grace leaves 0.035 */
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    struct nav_expected *e = nav_expected_new(&p.arena, &p.robot, l, 0.05, 8, 2);
    int free_poses = 0;
    for (int k = 0; k < 8; k++) {
        for (int j = -2; j < 22; j++) {
            for (int i = -2; i < 22; i++) {
                struct nav_pose pose = {(i + 0.5) * 0.05, (j + 0.5) * 0.05, (k + 0.5) * NAV_PI / 4.0};
                uint32_t signature = nav_expected_row(e, k, j)[i];
                if (!nav_arena_free(&p.arena, pose.x, pose.y, 0.035)) {
                    assert_int_equal(signature, 0);
                    continue;
                }
                uint8_t codes[2];
                nav_likelihood_expect(l, &p.arena, &p.robot, pose, codes);
                assert_memory_equal(e->codes + signature * 3, codes, 2);
                free_poses++;
            }
        }
    }
    /* 18 x 18 places are clear of the walls; 4 x 5 of them and 3 above touch the box, its corner is missed by 0.4 mm.
     */
    assert_int_equal(free_poses, 8 * (18 * 18 - 23));
    assert_in_range(e->signatures, 2, 200);
    nav_expected_free(e);
    nav_likelihood_free(l);
}

static void a_signature_is_worked_out_once_relative_to_a_bound(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    struct nav_expected *e = nav_expected_new(&p.arena, &p.robot, l, 0.1, 4, 1);
    const double texture[] = {0.0, -50.0}, distance = 0.1;
    const double *reading[] = {texture, &distance};
    const double both[] = {1.0, 1.0};
    nav_likelihood_read(l, &(struct nav_evidence){reading, both});
    nav_expected_evaluate(e, l);
    double bound = 0.0;
    for (int w = 0; w < 2; w++) {
        float most = -INFINITY;
        for (int k = 0; k < l->model[w].codes; k++)
            most = fmaxf(most, l->table[w][k]);
        bound += (double)most;
    }
    assert_in_range(e->signatures, 5, 200);
    for (uint32_t n = 1; n < e->signatures; n++)
        assert_near(e->value[n - 1], exp((double)nav_likelihood_of(l, e->codes + 3 * n) - bound), 1e-6);
    nav_expected_free(e);
    nav_likelihood_free(l);
}

static void a_robot_without_whiskers_expects_one_thing_everywhere(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.robot.tips = p.robot.rays = 0;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    struct nav_expected *e = nav_expected_new(&p.arena, &p.robot, l, 0.1, 4, 1);
    nav_expected_evaluate(e, l);
    assert_int_equal(e->signatures, 2);
    assert_near(e->value[0], 1.0, 0.0);
    nav_expected_free(e);
    nav_likelihood_free(l);
}

/* 20 whiskers whose tables span 60 nats each: the product would not fit a double. */
static void many_whiskers_do_not_underflow(void **state)
{
    (void)state;
    enum { WHISKERS = 20 };
    struct nav_problem p = room();
    struct nav_tip tip[WHISKERS];
    const double texture[] = {0.0, -1e9};
    double weights[WHISKERS];
    const double *reading[WHISKERS];
    for (int w = 0; w < WHISKERS; w++) {
        tip[w] = ROOM_TIP[0];
        reading[w] = texture;
        weights[w] = 1.0;
    }
    p.robot.tips = WHISKERS;
    p.robot.tip = tip;
    p.robot.rays = 0;
    p.settings.texture_outlier = 0.0;
    p.settings.texture_temper = 1.0;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    struct nav_expected *e = nav_expected_new(&p.arena, &p.robot, l, 0.1, 4, 1);
    for (int w = 0; w < WHISKERS; w++)
        l->trust[w].working = 1.0;
    nav_likelihood_read(l, &(struct nav_evidence){reading, weights});
    nav_expected_evaluate(e, l);
    assert_int_equal(e->signatures, 3);
    double low = fmin(e->value[0], e->value[1]);
    assert_true(low > 0.0 && low < 1e-290);
    assert_near(fmax(e->value[0], e->value[1]), 1.0, 1e-12);
    nav_expected_free(e);
    nav_likelihood_free(l);
}

static void a_lattice_too_large_is_refused(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    assert_null(nav_expected_new(&p.arena, &p.robot, l, 1e-6, 360, 2));
    assert_null(nav_expected_new(&p.arena, &p.robot, l, 0.5, 1, 10000)); /* its margin counts, too */
    nav_likelihood_free(l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texture_is_tempered_and_floored),
        cmocka_unit_test(however_sure_a_window_is_the_floor_remains),
        cmocka_unit_test(a_measured_distance_is_gaussian_on_a_floor_of_ghosts),
        cmocka_unit_test(no_contact_is_strong_evidence_deep_in_a_wall_and_weak_at_the_tip),
        cmocka_unit_test(whiskers_turn_with_the_robot),
        cmocka_unit_test(whiskers_add_and_those_not_read_say_nothing),
        cmocka_unit_test(codes_of_a_distance_are_finer_than_its_noise_and_reach_the_tip),
        cmocka_unit_test(the_table_holds_what_each_free_pose_expects),
        cmocka_unit_test(a_signature_is_worked_out_once_relative_to_a_bound),
        cmocka_unit_test(a_robot_without_whiskers_expects_one_thing_everywhere),
        cmocka_unit_test(many_whiskers_do_not_underflow),
        cmocka_unit_test(a_lattice_too_large_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
