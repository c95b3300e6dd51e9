#include "expected.h"
#include "likelihood.h"
#include "measurement.h"

#include "near.h"
#include "rooms.h"

static struct nav_settings settings(void)
{
    struct nav_settings s;
    nav_settings_default(&s);
    s.texture.temper = 0.05;
    s.texture.outlier = 0.2;
    s.radial.miss = 0.1;
    s.radial.ghost = 0.01;
    return s;
}

static struct nav_model classifier(const struct nav_settings *s, int classes)
{
    static const struct nav_tip tip = {0.0, 0.0};
    struct nav_model m = {.kind = &NAV_TEXTURE_MEASUREMENT, .settings = s};
    const struct nav_arena arena = {.classes = classes};
    const struct nav_robot robot = {.tips = 1, .tip = &tip};
    assert_int_equal(m.kind->init(&m, &arena, &robot, 0.0), 0);
    return m;
}

static void texture_is_tempered_and_floored(void **state)
{
    (void)state;
    struct nav_settings s = settings();
    struct nav_model m = classifier(&s, 2);
    const double loglik[] = {-500.0, -520.0};
    double out[3];
    m.kind->fill(&m, loglik, out);
    /* softmax(0, -1) = 0.7310586, 0.2689414; p = 0.8 share + 0.1; a broken whisker would say either with 1/2. */
    assert_near(out[0], 2.0 * (0.8 * 0.7310586 + 0.1), 1e-6);
    assert_near(out[1], 2.0 * (0.8 * 0.2689414 + 0.1), 1e-6);
    assert_near(out[2], 1.0, 0.0); /* where the texture is not known, a reading says nothing */
}

static void however_sure_a_window_is_the_floor_remains(void **state)
{
    (void)state;
    struct nav_settings s = settings();
    struct nav_model m = classifier(&s, 3);
    for (int sure = 0; sure < 3; sure++) {
        double loglik[] = {-1e6, -1e6, -1e6}, out[4];
        loglik[sure] = 0.0;
        m.kind->fill(&m, loglik, out);
        for (int k = 0; k < 3; k++)
            assert_near(out[k], k == sure ? 3.0 * 0.8 + 0.2 : 0.2, 1e-6);
    }
}

/* A whisker of 0.1 m whose distances are known to 4 cm: steps of 1 cm; its noise is then set to 1 cm. */
static struct nav_model whisker(const struct nav_settings *s)
{
    static const struct nav_ray ray = {0.0, 0.0, 0.0, 0.1};
    struct nav_model m = {.kind = &NAV_RANGE_MEASUREMENT, .settings = s};
    const struct nav_arena arena = {.classes = 1};
    const struct nav_robot robot = {.radial_sigma = 0.04, .rays = 1, .ray = &ray};
    assert_int_equal(m.kind->init(&m, &arena, &robot, 0.0), 0);
    assert_near(m.step, 0.01, 1e-12);
    assert_int_equal(m.codes, 15); /* 13 steps, nothing within reach, not known */
    m.sigma = 0.01;
    return m;
}

static void a_measured_distance_is_gaussian_on_a_floor_of_ghosts(void **state)
{
    (void)state;
    struct nav_settings s = settings();
    s.radial.edge_m = 0.01;
    struct nav_model m = whisker(&s);
    const double reading = 0.045, peak = 1.0 / (0.01 * sqrt(2.0 * NAV_PI)), ghost = 0.01, length = 0.1;
    double out[15];
    m.kind->fill(&m, &reading, out);
    assert_near(out[4], length * 0.9 * peak + 0.1 * ghost, 1e-4);
    assert_near(out[6], length * 0.9 * 0.9997674 * peak * exp(-2.0) + 0.1 * ghost, 1e-4);
    assert_near(out[13], ghost, 1e-5);
    assert_near(out[14], 1.0, 0.0);
    m.kind->free(&m);
}

static void no_contact_is_strong_evidence_deep_in_a_wall_and_weak_at_the_tip(void **state)
{
    (void)state;
    struct nav_settings s = settings();
    s.radial.edge_m = 0.01;
    struct nav_model m = whisker(&s);
    const double nothing = (double)INFINITY;
    double out[15];
    m.kind->fill(&m, &nothing, out);
    assert_near(out[4], (1.0 - 0.9) * 0.99, 1e-4);
    assert_near(out[13], 0.99, 1e-5);
    /* Codes 9 and 10 lie half a step on either side of the tip: noticed with 0.9 Phi(+-0.5). */
    assert_near(out[9], (1.0 - 0.9 * 0.6914625) * 0.99, 1e-5);
    assert_near(out[10], (1.0 - 0.9 * 0.3085375) * 0.99, 1e-5);
    m.kind->free(&m);
}

static void expect(const struct nav_likelihood *l, struct nav_pose p, uint8_t *codes)
{
    nav_likelihood_expect(l, &(struct nav_place){p.x, p.y, cos(p.theta), sin(p.theta)}, codes);
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
    expect(l, (struct nav_pose){0.2, 0.4, 0.0}, codes);
    assert_int_equal(codes[0], 1);
    /* Facing up at (0.4, 0.4): the tip is at (0.2, 0.5+), on tile 1; the ray starts at (0.3, 0.45) and points left. */
    expect(l, (struct nav_pose){0.4, 0.405, NAV_PI / 2.0}, codes);
    assert_int_equal(codes[0], 1);
    assert_int_equal(codes[1], l->model[1].codes - 2);
    /* Facing up at (0.2503, 0.4): the ray starts at 0.1503 and meets the wall after as much. */
    expect(l, (struct nav_pose){0.2503, 0.38, NAV_PI / 2.0}, codes);
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
    expect(l, (struct nav_pose){0.8503, 0.6, 0.0}, codes);
    assert_int_equal(codes[0], 0);
    assert_int_equal(codes[1], (int)floor(0.0997 / l->model[1].step));
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = both});
    float all = summed(l, codes);
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = one});
    float texture_only = summed(l, codes);
    double ratio[256];
    l->model[1].kind->fill(&l->model[1], &distance, ratio);
    double trust = l->trust[1].working, radial = log(trust * ratio[codes[1]] + 1.0 - trust);
    assert_near((double)all, (double)texture_only + radial, 1e-5);
    const double half[] = {0.0, 0.5};
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = half});
    assert_near((double)summed(l, codes), 0.5 * radial, 1e-5);
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = none});
    assert_near((double)summed(l, codes), 0.0, 0.0);
    nav_likelihood_free(l);
}

/* Expected distances are rounded to codes, of which a byte holds 256: finer than a contact's noise. */
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
        assert_true((l->model[1].codes - 2) * l->model[1].step >= ray.length);
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
    struct nav_expected *e = nav_expected_new(l, 0.1, 8, 2, 1);
    int free_poses = 0;
    for (int n = 0; n < 8 * 12 * 12 * 4; n++) { /* four poses of each cell, those around the arena included */
        int k = n / 4 / 144, j = n / 4 / 12 % 12 - 1, i = n / 4 % 12 - 1;
        struct nav_layer layer = nav_expected_layer(e, (k + 0.5) * NAV_PI / 4.0, 0.0, 0.0);
        struct nav_pose pose = {i * 0.1 + (n % 2 + 0.5) * 0.05, j * 0.1 + (n / 2 % 2 + 0.5) * 0.05,
                                (k + 0.5) * NAV_PI / 4.0};
        const uint8_t *reported = nav_expected_codes(e, &layer, j, i, n % 4);
        uint8_t codes[2];
        if (!nav_arena_free(&p.arena, pose.x, pose.y, 0.035)) {
            assert_null(reported);
            continue;
        }
        expect(l, pose, codes);
        assert_memory_equal(reported, codes, 2);
        free_poses++;
    }
    /* 18 x 18 places are clear of the walls; 4 x 5 of them and 3 above touch the box, its corner is missed by 0.4 mm.
     */
    assert_int_equal(free_poses, 8 * (18 * 18 - 23));
    assert_near(e->standing, (18.0 * 18.0 - 23.0) / 400.0, 1e-9);
    assert_in_range(e->signatures, 2, 200);
    nav_expected_free(e);
    nav_likelihood_free(l);
}

/* Values relative to the signature that suits the row best. */
static void assert_values(const struct nav_expected *e, const struct nav_likelihood *l)
{
    size_t width = (size_t)e->whiskers + 1;
    double best = -INFINITY;
    for (uint32_t n = 1; n < e->signatures; n++)
        best = fmax(best, (double)summed(l, e->codes + width * n));
    for (uint32_t n = 1; n < e->signatures; n++)
        assert_near((double)e->value[n], exp((double)summed(l, e->codes + width * n) - best), 1e-6);
}

static void a_signature_is_worked_out_once_relative_to_the_best(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    struct nav_expected *e = nav_expected_new(l, 0.1, 4, 1, 1);
    const double texture[] = {0.0, -50.0}, distance = 0.1;
    const double *reading[] = {texture, &distance};
    const double both[] = {1.0, 1.0};
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = both});
    nav_expected_begin(e, (const float *const *)l->table, 0.0f);
    nav_expected_scale(e);
    assert_in_range(e->signatures, 5, 200);
    assert_values(e, l);
    nav_expected_free(e);
    nav_likelihood_free(l);
}

/* A sensor of one's own that reads the floor's brightness through a map of 2 x 2 codes, 0.5 m each. */
static void an_own_sensor_weighs_poses_by_its_table(void **state)
{
    (void)state;
    static const uint8_t map_codes[] = {0, 1, 2, 255};
    const struct nav_sensor_map map = {3, 0.1, 0.0, 0.5, 2, 2, map_codes};
    const struct nav_sensor sensor = {3, 3, 0.0, 0.0, nav_sensor_map_expect, nav_sensor_map_fill, &map};
    struct nav_problem p = room();
    p.robot.tips = p.robot.rays = 0;
    p.robot.sensors = 1;
    p.robot.sensor = &sensor;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    static const struct nav_pose at[] = {
        {0.2, 0.2, 0.0}, {0.45, 0.2, 0.0}, {0.2, 0.7, 0.0}, {0.7, 0.7, 0.0}, {0.98, 0.2, 0.0}};
    uint8_t code[5];
    for (int n = 0; n < 5; n++)
        expect(l, at[n], &code[n]);
    const uint8_t wanted[] = {0, 1, 2, 3, 3}; /* not known, beyond the map: the last code */
    assert_memory_equal(code, wanted, 5);
    const double loglik[] = {log(0.2), log(0.7), log(0.1)};
    const double *reading[] = {loglik};
    const double one = 1.0;
    l->trust[0].working = 1.0;
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = &one});
    double reported[4];
    for (int k = 0; k < 4; k++)
        reported[k] = exp((double)l->table[0][k]);
    assert_near(reported[0] / reported[1], 2.0 / 7.0, 1e-5);
    assert_near((reported[0] + reported[1] + reported[2]) / 3.0, 1.0, 1e-5);
    assert_near(reported[3], 1.0, 1e-6);
    uint64_t bad = 0;
    const double broken[] = {0.0, NAN, 0.0}, none[] = {NAN, 0.0, 0.0};
    assert_int_equal(l->model[0].kind->check(&l->model[0], broken, &bad), NAV_BAD);
    assert_int_equal(l->model[0].kind->check(&l->model[0], none, &bad), NAV_NOT_READ);
    assert_int_equal(l->model[0].kind->check(&l->model[0], NULL, &bad), NAV_NOT_READ);
    assert_int_equal(bad, 1);
    nav_likelihood_free(l);
}

static void ground_never_mapped_expects_nothing_and_blocks_nobody(void **state)
{
    (void)state;
    struct nav_problem p = room();
    static const uint8_t floor[] = {0, 7, 1, 0};
    static const struct nav_box box[] = {{0.8, 0.0, 1.0, 0.3}, {0.0, 0.4, 0.3, 0.8}};
    p.arena.floor = floor;
    p.arena.boxes = 2;
    p.arena.box = box;
    p.arena.unknown = 1;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    uint8_t codes[2];
    expect(l, (struct nav_pose){0.7, 0.2, NAV_PI}, codes); /* the tip on the tile that is not known */
    assert_int_equal(codes[0], 2);
    assert_int_equal(codes[1], l->model[1].codes - 2);
    expect(l, (struct nav_pose){0.4, 0.6, NAV_PI}, codes); /* the whisker into ground never mapped */
    assert_int_equal(codes[1], l->model[1].codes - 1);
    expect(l, (struct nav_pose){0.6, 0.2, 0.0}, codes); /* a box first */
    assert_int_equal(codes[1], (int)((0.8 - 0.65) / l->model[1].step));
    assert_true(nav_likelihood_clear(l, 0.15, 0.6, 0.0));
    assert_false(nav_likelihood_clear(l, 0.9, 0.2, 0.0));
    nav_likelihood_free(l);
}

static void a_robot_without_whiskers_expects_one_thing_everywhere(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.robot.tips = p.robot.rays = 0;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    struct nav_expected *e = nav_expected_new(l, 0.1, 4, 1, 1);
    nav_expected_begin(e, (const float *const *)l->table, 0.0f);
    nav_expected_scale(e);
    assert_int_equal(e->signatures, 2);
    assert_near((double)e->value[1], 1.0, 0.0);
    nav_expected_free(e);
    nav_likelihood_free(l);
}

/* Signatures are numbered as the lattice meets them, which is not the order of a sensor's codes. */
static void a_robot_with_one_whisker_is_weighed_by_its_codes(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.robot.tips = 0;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    struct nav_expected *e = nav_expected_new(l, 0.05, 8, 1, 1);
    const double distance = 0.1, one = 1.0;
    const double *reading[] = {&distance};
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = &one});
    nav_expected_begin(e, (const float *const *)l->table, 0.0f);
    nav_expected_scale(e);
    assert_in_range(e->signatures, 5, 200);
    assert_values(e, l);
    nav_expected_free(e);
    nav_likelihood_free(l);
}

/* 20 whiskers, half of which contradict the others by far: what either texture gets would not fit single precision. */
static void many_whiskers_do_not_underflow(void **state)
{
    (void)state;
    enum { WHISKERS = 20 };
    struct nav_problem p = room();
    struct nav_tip tip[WHISKERS];
    const double texture[2][2] = {{0.0, -1e9}, {-1e9, 0.0}};
    double weights[WHISKERS];
    const double *reading[WHISKERS];
    for (int w = 0; w < WHISKERS; w++) {
        tip[w] = ROOM_TIP[0];
        reading[w] = texture[w % 2];
        weights[w] = 1.0;
    }
    p.robot.tips = WHISKERS;
    p.robot.tip = tip;
    p.robot.rays = 0;
    p.settings.texture.outlier = 0.0;
    p.settings.texture.temper = 1.0;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    struct nav_expected *e = nav_expected_new(l, 0.1, 4, 1, 1);
    for (int w = 0; w < WHISKERS; w++)
        l->trust[w].working = 1.0;
    nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = weights});
    nav_expected_begin(e, (const float *const *)l->table, 0.0f);
    nav_expected_scale(e);
    assert_int_equal(e->signatures, 3);
    assert_near((double)e->value[1], 1.0, 1e-6);
    assert_near((double)e->value[2], 1.0, 1e-6);
    nav_expected_free(e);
    nav_likelihood_free(l);
}

static void a_lattice_too_large_is_refused(void **state)
{
    (void)state;
    struct nav_problem p = room();
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.01);
    assert_null(nav_expected_new(l, 1e-6, 360, 2, 1));
    assert_null(nav_expected_new(l, 0.5, 1, 10000, 1)); /* its margin counts, too */
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
        cmocka_unit_test(a_signature_is_worked_out_once_relative_to_the_best),
        cmocka_unit_test(an_own_sensor_weighs_poses_by_its_table),
        cmocka_unit_test(ground_never_mapped_expects_nothing_and_blocks_nobody),
        cmocka_unit_test(a_robot_without_whiskers_expects_one_thing_everywhere),
        cmocka_unit_test(a_robot_with_one_whisker_is_weighed_by_its_codes),
        cmocka_unit_test(many_whiskers_do_not_underflow),
        cmocka_unit_test(a_lattice_too_large_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
