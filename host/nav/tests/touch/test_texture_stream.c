/* One posterior over windows in a row: names, edges that hold the tip, surfaces never trained, early answers. */
#include <stdbool.h>

#include "near.h"
#include "texture_features.h"
#include "texture_stream.h"

enum { BLOCK = 16, WINDOW = 32, FEATURES_MOST = 64 };

static const double LOUD = 7.38905609893065; /* amplitude whose log power is 4 */
static const double HAZARD = 1e-3;

static void the_filter_is_the_forward_recursion(void **state)
{
    (void)state;
    double p[3], alone = 1.0;
    const double loglik[] = {-1.0, 0.0, -3.0};
    nav_texture_filter_start(p, 3);
    nav_texture_filter_weigh(p, 3, loglik, 0.5);
    double sum = exp(-0.5) + 1.0 + exp(-1.5);
    assert_near(p[0], exp(-0.5) / sum, 1e-12);
    nav_texture_filter_change(p, 3, 0.1);
    assert_near(p[1], 0.9 / sum + 0.1 * 0.5 * (1.0 - 1.0 / sum), 1e-12);
    assert_near(p[0] + p[1] + p[2], 1.0, 1e-12);
    nav_texture_filter_change(&alone, 1, 0.1);
    assert_true(alone == 1.0);
}

static void a_class_ruled_out_comes_back(void **state)
{
    (void)state;
    double p[2];
    const double one[] = {0.0, -1e6}, other[] = {-1e6, 0.0};
    nav_texture_filter_start(p, 2);
    nav_texture_filter_weigh(p, 2, one, 1.0);
    assert_true(p[0] == 1.0);
    nav_texture_filter_weigh(p, 2, other, 1.0);
    assert_true(isfinite(p[0]) && isfinite(p[1]));
    nav_texture_filter_change(p, 2, HAZARD);
    nav_texture_filter_weigh(p, 2, other, 1.0);
    assert_true(p[1] > 0.999);
}

/* One channel, classifier windows of 16 samples; two classes distinguished by the log of the power of the steps alone,
 * which is `quiet` for an amplitude of 1: about that and about 4 more. */
struct model {
    double floor, weight[2 * FEATURES_MOST], bias[2], spike, quiet;
    int count;
    struct nav_texture_classifier *classifier;
};

static void make_model(struct model *m)
{
    double window[BLOCK], features[FEATURES_MOST];
    *m = (struct model){.spike = 1e3};
    struct nav_texture_features *f = nav_texture_features_new(1, BLOCK, &m->floor, NULL);
    for (int i = 0; i < BLOCK; i++)
        window[i] = i % 2 ? 1.0 : -1.0;
    nav_texture_features_work(f, window, features);
    m->count = nav_texture_features_count(f);
    m->quiet = features[m->count - 1];
    nav_texture_features_free(f);
    m->weight[2 * (m->count - 1) + 1] = 4.0;
    m->bias[1] = -8.0 - 4.0 * m->quiet;
    const struct nav_texture_classifier_numbers numbers = {.classes = 2,
                                                           .channels = 1,
                                                           .length = BLOCK,
                                                           .behind = 0.5,
                                                           .floor = &m->floor,
                                                           .weight = m->weight,
                                                           .bias = m->bias};
    m->classifier = nav_texture_classifier_new(&numbers);
    assert_non_null(m->classifier);
}

static struct nav_texture_rules rules_of(const struct model *m, int step)
{
    return (struct nav_texture_rules){.channels = 1,
                                      .classes = 2,
                                      .window = WINDOW,
                                      .classifiers = 1,
                                      .classifier = &m->classifier,
                                      .hazard = HAZARD,
                                      .doubt = 0.6,
                                      .step = step,
                                      .sure = 0.95,
                                      .patience = step ? 2 * WINDOW : 0,
                                      .limits = {.channels = 1, .spike = &m->spike}};
}

static struct nav_texture_stream *stream_of(const struct model *m, int step)
{
    const struct nav_texture_rules rules = rules_of(m, step);
    struct nav_texture_stream *s = nav_texture_stream_new(&rules);
    assert_non_null(s);
    return s;
}

/* Pushes n samples alternating by +-amplitude; returns the last decision and how many there were. */
static int drive(struct nav_texture_stream *s, double amplitude, int n, struct nav_texture_decision *d, double *loglik)
{
    int count = 0, decided;
    for (int i = 0; i < n; i++) {
        double x = 1000.0 + (i % 2 ? amplitude : -amplitude);
        assert_int_equal(nav_texture_stream_push(s, &x, 1, &decided, d, loglik), 1);
        count += decided;
    }
    return count;
}

/* A window's evidence is its own; the confidence is that of the forward recursion, in which the first counts whole. A
 * window between the classes changes nothing, and one window of the other class does not turn what ten have said. */
static void windows_in_a_row_are_one_posterior(void **state)
{
    (void)state;
    struct model m;
    struct nav_texture_decision d;
    double loglik[2], p[2], soft = exp(0.9), between = exp(1.0), chance = 1.0 - exp(-HAZARD * BLOCK);
    make_model(&m);
    struct nav_texture_rules rules = rules_of(&m, 0);
    rules.window = BLOCK;
    struct nav_texture_stream *s = nav_texture_stream_new(&rules);
    nav_texture_filter_start(p, 2);
    for (int i = 0; i < 10; i++) {
        assert_int_equal(drive(s, soft, BLOCK, &d, loglik), 1);
        assert_near(loglik[1], 4.0 * 1.8 - 8.0, 1e-6);
        nav_texture_filter_change(p, 2, chance);
        nav_texture_filter_weigh(p, 2, loglik, i == 0 ? 1.0 : 0.5);
        assert_near(d.confidence, p[0], 1e-9);
        assert_true(d.best == 0 && d.samples == BLOCK);
    }
    assert_true(d.label == 0 && d.confidence > 0.9);
    drive(s, between, BLOCK, &d, loglik);
    assert_near(loglik[1], 0.0, 1e-6);
    assert_true(d.label == 0 && d.confidence < p[0]);
    drive(s, exp(1.2), BLOCK, &d, loglik);
    assert_true(loglik[0] < -1.0 && d.best == 0);
    drive(s, LOUD, BLOCK, &d, loglik);
    assert_true(d.label == 1);
    nav_texture_stream_reset(s);
    drive(s, between, BLOCK, &d, loglik);
    assert_near(d.confidence, 0.5, 1e-6);
    assert_int_equal(d.label, NAV_TEXTURE_UNKNOWN);
    nav_texture_stream_free(s);
    nav_texture_classifier_free(m.classifier);
}

/* Of samples that fill two of the classifier's windows the first counts whole and the second as those behind; once
 * there was evidence, both count as those behind. */
static void a_longer_window_counts_as_those_that_fill_it(void **state)
{
    (void)state;
    struct model m;
    struct nav_texture_decision d;
    double loglik[2], p[2], soft = exp(0.9), chance = 1.0 - exp(-HAZARD * WINDOW);
    make_model(&m);
    struct nav_texture_stream *s = stream_of(&m, 0);
    nav_texture_filter_start(p, 2);
    for (int i = 0; i < 3; i++) {
        drive(s, soft, WINDOW, &d, loglik);
        assert_near(loglik[1], 2.0 * (4.0 * 1.8 - 8.0), 1e-6);
        nav_texture_filter_change(p, 2, chance);
        nav_texture_filter_weigh(p, 2, loglik, i == 0 ? 0.75 : 0.5);
        assert_near(d.confidence, p[0], 1e-9);
    }
    nav_texture_stream_reset(s);
    drive(s, NAN, WINDOW, &d, loglik);
    drive(s, soft, WINDOW, &d, loglik);
    nav_texture_filter_start(p, 2);
    nav_texture_filter_weigh(p, 2, loglik, 0.75);
    assert_near(d.confidence, p[0], 1e-9);
    nav_texture_stream_free(s);
    nav_texture_classifier_free(m.classifier);
}

/* Samples that an edge caught, and those that are not readable, are no evidence, and what was known stays likely. */
static void an_edge_is_no_evidence(void **state)
{
    (void)state;
    const double span = 100.0, spoiled[] = {200.0, NAN};
    for (int e = 0; e < 2; e++) {
        struct model m;
        struct nav_texture_decision d;
        double loglik[2];
        make_model(&m);
        struct nav_texture_rules rules = rules_of(&m, 0);
        rules.limits.span = &span;
        struct nav_texture_stream *s = nav_texture_stream_new(&rules);
        drive(s, 1.0, 10 * WINDOW, &d, loglik);
        assert_int_equal(drive(s, spoiled[e], WINDOW, &d, loglik), 1);
        assert_true(d.label == NAV_TEXTURE_UNKNOWN && d.confidence == 0.0 && loglik[0] == 0.0 && loglik[1] == 0.0);
        drive(s, 1.0, WINDOW, &d, loglik);
        assert_true(d.label == 0 && d.confidence > 0.95);
        nav_texture_stream_free(s);
        nav_texture_classifier_free(m.classifier);
    }
}

/* Behind an edge the surface may be another: a window that is in doubt there is not named by what lay before. */
static void an_edge_may_be_a_border(void **state)
{
    (void)state;
    struct model m;
    struct nav_texture_decision d;
    double loglik[2];
    const double span = 100.0;
    make_model(&m);
    struct nav_texture_rules rules = rules_of(&m, 0);
    rules.limits.span = &span;
    struct nav_texture_stream *s = nav_texture_stream_new(&rules);
    drive(s, 1.0, 10 * WINDOW, &d, loglik);
    drive(s, exp(1.05), WINDOW, &d, loglik);
    assert_int_equal(d.label, 0);
    drive(s, 200.0, WINDOW, &d, loglik);
    drive(s, exp(1.05), WINDOW, &d, loglik);
    assert_true(d.best == 1 && d.label == NAV_TEXTURE_UNKNOWN);
    nav_texture_stream_free(s);
    nav_texture_classifier_free(m.classifier);
}

/* The distance is along the log of the steps' power alone: its limit is 2 deviations of one window. */
static struct nav_texture_novelty *novelty_of(const struct model *m)
{
    static double turn[FEATURES_MOST * FEATURES_MOST], mean[2 * FEATURES_MOST], row[FEATURES_MOST];
    int count = m->count, power = count - 1;
    turn[power * count + power] = 1.0;
    mean[power] = m->quiet;
    mean[count + power] = m->quiet + 4.0;
    double limit[NAV_TEXTURE_ROW];
    for (int w = 0; w < NAV_TEXTURE_ROW; w++)
        limit[w] = (w == 2 ? 8.0 : 4.0) / count; /* three windows may lie farther */
    const struct nav_texture_novelty_numbers n = {
        .classes = 2, .features = count, .turn = turn, .mean = mean, .row = row, .limit = limit};
    return nav_texture_novelty_new(&n);
}

/* The mean square of the deviations of the mean of windows, over the limit. */
static void novelty_is_the_distance_to_the_nearest_surface(void **state)
{
    (void)state;
    struct model m;
    double features[FEATURES_MOST] = {0.0};
    make_model(&m);
    struct nav_texture_novelty *v = novelty_of(&m);
    features[m.count - 1] = m.quiet + 1.0;
    for (int w = 1; w <= 40; w++)
        assert_near(nav_texture_novelty_weigh(v, features), (w < 16 ? w : 16) / (w == 3 ? 8.0 : 4.0), 1e-9);
    nav_texture_novelty_reset(v);
    features[m.count - 1] = m.quiet + 3.5;
    assert_near(nav_texture_novelty_weigh(v, features), 0.25 / 4.0, 1e-9);
    nav_texture_novelty_free(v);
    nav_texture_classifier_free(m.classifier);
}

/* Windows of 16, as novelty's own, of 32, and sequential decisions, which are sure of the louder class at once. */
static void a_surface_never_trained_is_unknown_in_windows_of_any_length(void **state)
{
    (void)state;
    struct model m;
    make_model(&m);
    for (int mode = 0; mode < 3; mode++) {
        struct nav_texture_decision d;
        double loglik[2];
        struct nav_texture_rules rules = rules_of(&m, mode == 2 ? BLOCK : 0);
        rules.novelty = novelty_of(&m);
        rules.window = mode == 0 ? BLOCK : WINDOW;
        struct nav_texture_stream *s = nav_texture_stream_new(&rules);
        drive(s, 1.0, WINDOW, &d, loglik);
        assert_true(d.label == 0 && d.novelty < 0.05);
        nav_texture_stream_reset(s);
        drive(s, 400.0, 2 * WINDOW, &d, loglik);
        assert_true(d.label == NAV_TEXTURE_UNKNOWN && d.best == 1 && d.novelty > 1.0);
        assert_true(d.confidence > 0.95 && loglik[0] < -8.0); /* the probabilities are left alone */
        drive(s, NAN, 2 * WINDOW, &d, loglik);                /* unreadable samples end the row */
        assert_true(d.novelty == 0.0);
        drive(s, 1.0, 2 * WINDOW, &d, loglik);
        assert_true(d.label == 0 && d.novelty < 0.05);
        drive(s, LOUD, 2 * WINDOW, &d, loglik); /* windows of two surfaces have no common mean */
        assert_true(d.label == 1 && d.novelty < 0.05);
        nav_texture_stream_free(s);
        nav_texture_novelty_free(rules.novelty);
    }
    nav_texture_classifier_free(m.classifier);
}

static void bad_windows_are_no_evidence_and_never_nan(void **state)
{
    (void)state;
    struct model m;
    struct nav_texture_decision d;
    double loglik[2] = {7.0, 7.0};
    make_model(&m);
    struct nav_texture_stream *s = stream_of(&m, 0);
    drive(s, 1.0, WINDOW - 9, &d, loglik);
    drive(s, NAN, 9, &d, loglik);
    assert_int_equal(d.health.bad, 9);
    assert_true(d.label == NAV_TEXTURE_UNKNOWN && d.confidence == 0.0 && loglik[0] == 0.0 && loglik[1] == 0.0);
    drive(s, 1.0, WINDOW, &d, loglik);
    assert_true(d.label == 0 && d.health.bad == 0);
    nav_texture_stream_free(s);
    nav_texture_classifier_free(m.classifier);
}

/* The same posterior with and without: what is known already makes an answer early. */
static void sequential_decisions_stop_when_sure_and_give_up(void **state)
{
    (void)state;
    struct model m;
    struct nav_texture_decision d;
    double loglik[2], between = exp(1.0), soft = exp(0.9);
    make_model(&m);
    struct nav_texture_stream *s = stream_of(&m, BLOCK);
    assert_int_equal(drive(s, 1.0, BLOCK, &d, loglik), 1);
    assert_true(d.label == 0 && d.samples == BLOCK && d.confidence > 0.95);
    assert_int_equal(drive(s, soft, BLOCK, &d, loglik), 1);
    nav_texture_stream_reset(s);
    assert_int_equal(drive(s, soft, BLOCK, &d, loglik), 0);
    nav_texture_stream_reset(s);
    assert_int_equal(drive(s, between, 2 * WINDOW - 1, &d, loglik), 0);
    assert_int_equal(drive(s, between, 1, &d, loglik), 1);
    assert_true(d.label == NAV_TEXTURE_UNKNOWN && d.samples == 2 * WINDOW);
    nav_texture_stream_reset(s);
    drive(s, exp(0.96), 2 * WINDOW, &d, loglik);
    assert_true(d.label == NAV_TEXTURE_UNKNOWN && d.confidence > 0.6 && d.samples == 2 * WINDOW);
    nav_texture_stream_free(s);
    nav_texture_classifier_free(m.classifier);
}

static void impossible_rules_make_no_stream(void **state)
{
    (void)state;
    struct model m;
    make_model(&m);
    struct nav_texture_classifier *twice[] = {m.classifier, m.classifier};
    struct nav_texture_rules rules[6];
    for (int i = 0; i < 6; i++)
        rules[i] = rules_of(&m, 0);
    rules[0].classifier = twice;
    rules[0].classifiers = 2;
    rules[1].window = 1;
    rules[2].hazard = 0.0;
    rules[3].hazard = NAN;
    rules[4].limits.channels = 2;
    rules[5].step = 8;
    rules[5].patience = 4;
    for (int i = 0; i < 6; i++)
        assert_null(nav_texture_stream_new(rules + i));
    nav_texture_stream_free(NULL);
    nav_texture_classifier_free(m.classifier);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_filter_is_the_forward_recursion),
        cmocka_unit_test(a_class_ruled_out_comes_back),
        cmocka_unit_test(windows_in_a_row_are_one_posterior),
        cmocka_unit_test(a_longer_window_counts_as_those_that_fill_it),
        cmocka_unit_test(an_edge_is_no_evidence),
        cmocka_unit_test(an_edge_may_be_a_border),
        cmocka_unit_test(novelty_is_the_distance_to_the_nearest_surface),
        cmocka_unit_test(a_surface_never_trained_is_unknown_in_windows_of_any_length),
        cmocka_unit_test(bad_windows_are_no_evidence_and_never_nan),
        cmocka_unit_test(sequential_decisions_stop_when_sure_and_give_up),
        cmocka_unit_test(impossible_rules_make_no_stream),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
