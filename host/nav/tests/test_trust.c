/* What whiskers teach about themselves: temper, accuracy, trust. */
#include "trust.h"

#include "likelihood.h"
#include "near.h"
#include "rng.h"
#include "rooms.h"

static struct nav_model classifier(const struct nav_settings *s, int classes)
{
    static const struct nav_tip tip = {0.0, 0.0};
    struct nav_model m = {.kind = &NAV_TEXTURE_MEASUREMENT, .settings = s};
    const struct nav_arena arena = {.classes = classes};
    const struct nav_robot robot = {.tips = 1, .tip = &tip};
    assert_int_equal(m.kind->init(&m, &arena, &robot, 0.0), 0);
    return m;
}

static double odds_after(struct nav_model *m, double gap)
{
    double out[4];
    const double reading[] = {-gap, 0.0, -gap};
    m->kind->fill(m, reading, out);
    return log(out[1] / out[0]);
}

static void raw_sums_and_calibrated_scores_come_out_alike(void **state)
{
    (void)state;
    struct nav_settings s;
    nav_settings_default(&s);
    struct nav_model raw = classifier(&s, 3), calibrated = classifier(&s, 3);
    struct nav_rng rng;
    nav_rng_seed(&rng, 3, 0);
    for (int i = 0; i < 200; i++) {
        double gap = 8.0 * exp(0.5 * nav_rng_normal(&rng));
        assert_near(odds_after(&raw, 100.0 * gap), odds_after(&calibrated, gap), 0.3);
    }
    assert_near(raw.gap / calibrated.gap, 100.0, 1e-6);
    /* A typical window: 0.87 for its class, 0.065 for each other. */
    assert_near(odds_after(&raw, raw.gap), log(0.87 / 0.065), 0.15);
}

static void the_first_window_is_already_tempered(void **state)
{
    (void)state;
    struct nav_settings s;
    nav_settings_default(&s);
    struct nav_model m = classifier(&s, 3);
    assert_true(odds_after(&m, 600.0) < log(0.9 / 0.05));
}

static void a_temper_never_sharpens_and_a_fixed_one_stays(void **state)
{
    (void)state;
    struct nav_settings s;
    nav_settings_default(&s);
    struct nav_model vague = classifier(&s, 3);
    for (int i = 0; i < 100; i++)
        odds_after(&vague, 0.01);
    assert_near(vague.temper, 1.0, 0.0);
    s.texture.temper = 0.03;
    struct nav_model fixed = classifier(&s, 3);
    odds_after(&fixed, 600.0);
    assert_near(fixed.temper, 0.03, 0.0);
}

static void a_window_that_says_nothing_changes_nothing(void **state)
{
    (void)state;
    struct nav_settings s;
    nav_settings_default(&s);
    struct nav_model m = classifier(&s, 3);
    odds_after(&m, 600.0);
    double before = m.temper;
    assert_near(odds_after(&m, 0.0), 0.0, 1e-6);
    assert_near(m.temper, before, 0.0);
}

/* Two floor whiskers and an object whisker, all explained by one believed pose. */
struct bench {
    struct nav_likelihood *likelihood;
    uint8_t codes[3];
    struct nav_track *track;
};

static const struct nav_tip TIPS[] = {{0.1, 0.1}, {0.1, -0.1}};

static struct bench bench(void)
{
    static struct nav_problem p;
    p = room();
    p.robot.tips = 2;
    p.robot.tip = TIPS;
    struct bench b = {.likelihood = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0)};
    nav_likelihood_expect(b.likelihood, &(struct nav_place){0.2, 0.25, 1.0, 0.0}, b.codes);
    assert_int_equal(b.codes[0], 0);
    assert_int_equal(b.codes[1], 0);
    return b;
}

/* A row in which each texture whisker says its expected class (agree) or the other one. */
static void read_row(struct bench *b, bool left_agrees, bool right_agrees, double mass)
{
    const double right[] = {0.0, -10.0}, wrong[] = {-10.0, 0.0}, none = (double)INFINITY, weight[] = {1.0, 1.0, 1.0};
    const double *reading[] = {left_agrees ? right : wrong, right_agrees ? right : wrong, &none};
    nav_likelihood_read(b->likelihood, &(struct nav_evidence){.reading = reading, .weight = weight, .track = b->track});
    nav_trust_begin(b->likelihood);
    nav_trust_add(b->likelihood, b->codes, mass);
    nav_trust_learn(b->likelihood);
}

static void a_whisker_that_keeps_disagreeing_is_no_longer_heard(void **state)
{
    (void)state;
    struct bench b = bench();
    for (int i = 0; i < 60; i++)
        read_row(&b, i % 2, true, 1.0);
    assert_true(b.likelihood->trust[0].working < 0.1 && b.likelihood->trust[1].working > 0.9);
    assert_true(b.likelihood->model[0].accuracy < b.likelihood->model[1].accuracy);
    read_row(&b, false, true, 1.0);
    double heard = fabs((double)(b.likelihood->table[0][0] - b.likelihood->table[0][1]));
    assert_true(heard < 0.2 * fabs((double)(b.likelihood->table[1][0] - b.likelihood->table[1][1])));
    for (int i = 0; i < 60; i++)
        read_row(&b, true, true, 1.0);
    assert_true(b.likelihood->trust[0].working > 0.9); /* it has been mended */
    nav_likelihood_free(b.likelihood);
}

static void when_all_disagree_it_is_the_belief_that_is_wrong(void **state)
{
    (void)state;
    struct bench b = bench();
    for (int i = 0; i < 100; i++)
        read_row(&b, true, true, 1.0);
    for (int i = 0; i < 100; i++)
        read_row(&b, false, false, 1.0);
    assert_true(b.likelihood->trust[0].working > 0.5 && b.likelihood->trust[1].working > 0.5);
    nav_likelihood_free(b.likelihood);
}

static void an_unsure_belief_teaches_nothing(void **state)
{
    (void)state;
    struct bench b = bench();
    double accuracy = b.likelihood->model[0].accuracy;
    for (int i = 0; i < 100; i++)
        read_row(&b, i % 2, true, 0.0);
    assert_true(b.likelihood->trust[0].working > 0.95);
    assert_near(b.likelihood->model[0].accuracy, accuracy, 0.0);
    nav_likelihood_free(b.likelihood);
}

static void what_was_expected_of_a_reading_is_noted(void **state)
{
    (void)state;
    struct bench b = bench();
    struct nav_track track[3] = {{.expected = 0.0}};
    b.track = track;
    read_row(&b, true, false, 0.75);
    assert_near(track[0].expected, 0.75, 0.0);
    assert_near(track[1].expected, 0.0, 0.0); /* all of the belief expected the other class */
    nav_likelihood_free(b.likelihood);
}

static void a_lone_whisker_is_always_heard(void **state)
{
    (void)state;
    struct nav_problem p = room();
    p.robot.rays = 0;
    struct nav_likelihood *l = nav_likelihood_new(&p.arena, &p.robot, &p.settings, 0.0);
    const double wrong[] = {-10.0, 0.0}, weight[] = {1.0};
    const double *reading[] = {wrong};
    const uint8_t codes[] = {0};
    for (int i = 0; i < 100; i++) {
        nav_likelihood_read(l, &(struct nav_evidence){.reading = reading, .weight = weight});
        nav_trust_begin(l);
        nav_trust_add(l, codes, 1.0);
        nav_trust_learn(l);
    }
    assert_true(l->trust[0].working > 0.9);
    nav_likelihood_free(l);
}

static void an_object_whisker_that_feels_nothing_where_walls_are_is_found_out(void **state)
{
    (void)state;
    struct bench b = bench();
    const double right[] = {0.0, -10.0}, none = (double)INFINITY, weight[] = {1.0, 1.0, 1.0};
    const double *reading[] = {right, right, &none};
    b.codes[2] = 4;
    for (int i = 0; i < 10; i++) {
        nav_likelihood_read(b.likelihood, &(struct nav_evidence){.reading = reading, .weight = weight});
        nav_trust_begin(b.likelihood);
        nav_trust_add(b.likelihood, b.codes, 1.0);
        nav_trust_learn(b.likelihood);
    }
    assert_true(b.likelihood->trust[2].working < 0.05);
    nav_likelihood_free(b.likelihood);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(raw_sums_and_calibrated_scores_come_out_alike),
        cmocka_unit_test(the_first_window_is_already_tempered),
        cmocka_unit_test(a_temper_never_sharpens_and_a_fixed_one_stays),
        cmocka_unit_test(a_window_that_says_nothing_changes_nothing),
        cmocka_unit_test(a_whisker_that_keeps_disagreeing_is_no_longer_heard),
        cmocka_unit_test(when_all_disagree_it_is_the_belief_that_is_wrong),
        cmocka_unit_test(an_unsure_belief_teaches_nothing),
        cmocka_unit_test(what_was_expected_of_a_reading_is_noted),
        cmocka_unit_test(a_lone_whisker_is_always_heard),
        cmocka_unit_test(an_object_whisker_that_feels_nothing_where_walls_are_is_found_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
