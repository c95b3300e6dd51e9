/* A change of surface within a drive, and a surface never trained that no window by itself gives away. */
#include <stdbool.h>

#include "near.h"
#include "texture_change.h"
#include "texture_features.h"
#include "texture_novelty.h"

enum { LENGTH = 16, FEATURES_MOST = 64 };

/* One channel; two classes whose log power is 0 and 4, with unit variance within a drive. */
struct numbers {
    double floor, steady[2 * FEATURES_MOST], edge[2 * FEATURES_MOST], apart[4], weight[2 * FEATURES_MOST], bias[2];
};

static struct nav_texture_change *make(struct numbers *m, double limit)
{
    *m = (struct numbers){.apart = {0.0, 16.0, 16.0, 0.0}, .bias = {0.0, -8.0}};
    struct nav_texture_features *f = nav_texture_features_new(1, LENGTH, 0, 0, &m->floor, NULL);
    int power = nav_texture_features_count(f) - 2;
    nav_texture_features_free(f);
    m->steady[2 * power + 1] = m->weight[2 * power + 1] = 4.0;
    m->edge[2 * (power - 1) + 1] = 4.0; /* the highest band alone */
    const struct nav_texture_change_numbers n = {.classes = 2,
                                                 .channels = 1,
                                                 .length = LENGTH,
                                                 .share = 1.0,
                                                 .limit = limit,
                                                 .floor = &m->floor,
                                                 .inside = {m->steady, m->apart, m->weight, m->bias},
                                                 .edge = {m->edge, m->apart, m->edge, m->bias}};
    return nav_texture_change_new(&n);
}

static double weigh(struct nav_texture_change *c, double amplitude, int *after)
{
    double block[LENGTH];
    for (int i = 0; i < LENGTH; i++)
        block[i] = 500.0 + (i % 2 ? amplitude : -amplitude);
    return nav_texture_change_weigh(c, block, after);
}

static void a_change_is_found_where_it_is(void **state)
{
    (void)state;
    struct numbers m;
    int after;
    struct nav_texture_change *c = make(&m, 1e3);
    for (int i = 0; i < 3; i++)
        assert_true(weigh(c, 1.0, &after) < -1e8);
    for (int i = 0; i < 40; i++)
        assert_true(weigh(c, 1.0, &after) < 0.0);
    for (int i = 1; i <= NAV_TEXTURE_CHANGE_AFTER_MOST; i++) {
        double found = weigh(c, exp(2.0), &after);
        assert_true(i < 2 ? found < 5.0 : found > 5.0 && after == i);
    }
    nav_texture_change_free(c);
    c = make(&m, 5.0);
    for (int i = 0; i < 10; i++)
        weigh(c, 1.0, &after);
    assert_true(weigh(c, exp(2.0), &after) < 5.0 && weigh(c, exp(2.0), &after) > 5.0);
    assert_true(weigh(c, exp(2.0), &after) <
                -1e8); /* what lay before is forgotten, and three leave no two before two */
    assert_true(weigh(c, exp(2.0), &after) < 0.0);
    nav_texture_change_free(c);
}

/* The ratio written out: 6 before, 3 after, the mean of log power 4 higher, both sides named right. */
static void the_ratio_is_the_formula(void **state)
{
    (void)state;
    struct numbers m;
    int after;
    double last = 0.0;
    struct nav_texture_change *c = make(&m, 1e3);
    for (int i = 0; i < 9; i++)
        last = weigh(c, i < 6 ? 1.0 : exp(2.0), &after);
    assert_int_equal(after, 3);
    assert_near(last, 3.0 * 6.0 / 9.0 * (16.0 - 8.0), 1e-6);
    nav_texture_change_free(c);
}

/* The drive falls by as much as the classes differ, but is as loud as the second class even then: what each of the 3
 * blocks after the fall says against the first class counts half against the change. */
static void a_side_that_does_not_sound_like_its_class_counts_against_the_change(void **state)
{
    (void)state;
    struct numbers m;
    int after;
    double last = 0.0, first_class = 1.0 / (1.0 + exp(8.0));
    struct nav_texture_change *c = make(&m, 1e3);
    for (int i = 0; i < 9; i++)
        last = weigh(c, i < 6 ? exp(4.0) : exp(2.0), &after);
    double against = 3.0 * log((0.99 * first_class + 0.005) / (0.99 * (1.0 - first_class) + 0.005));
    assert_int_equal(after, 3);
    assert_near(last, 3.0 * 6.0 / 9.0 * (16.0 - 8.0) + 0.5 * against, 1e-6);
    nav_texture_change_free(c);
}

/* A stretch twice as far off as the other class is hardly more evidence than the class itself: the formula without the
 * bound would say three times as much. */
static void a_stray_block_claims_no_more_than_the_classes_differ(void **state)
{
    (void)state;
    struct numbers m;
    int after;
    double last = 0.0;
    struct nav_texture_change *c = make(&m, 1e3);
    for (int i = 0; i < 9; i++)
        last = weigh(c, i < 6 ? 1.0 : exp(4.0), &after);
    assert_true(last > 15.0 && last < 20.0);
    nav_texture_change_free(c);
}

/* A whisker that is louder by the same factor throughout, halfway to the other class, has no border. */
static void what_a_drive_has_of_its_own_is_no_change(void **state)
{
    (void)state;
    struct numbers m;
    int after;
    struct nav_texture_change *c = make(&m, 5.0);
    for (int i = 0; i < 30; i++)
        assert_true(weigh(c, exp(1.0), &after) < 0.0);
    nav_texture_change_free(c);
}

/* A block of +-amplitude, and a slow swing of the whisker below it. */
static double ring(struct nav_texture_change *c, double amplitude, double swing, int *after)
{
    double block[LENGTH];
    for (int i = 0; i < LENGTH; i++)
        block[i] = (i % 2 ? amplitude : -amplitude) + swing * cos(2.0 * acos(-1.0) * i / LENGTH);
    return nav_texture_change_weigh(c, block, after);
}

/* Whether a change is found among six blocks after ten of the first class, and after how many of them. */
static int found_after(bool edge, double amplitude, double swing)
{
    struct numbers m;
    int after, found = 0;
    struct nav_texture_change *c = make(&m, 5.0);
    for (int i = 0; i < 10; i++)
        weigh(c, 1.0, &after);
    if (edge)
        nav_texture_change_edge(c);
    for (int i = 1; i <= NAV_TEXTURE_CHANGE_AFTER_MOST && !found; i++)
        found = ring(c, amplitude, swing, &after) > 5.0 ? i : 0;
    nav_texture_change_free(c);
    return found;
}

/* The whisker rings in its own low bands behind an edge: there the others alone show whether the surface is another.
 * The first block behind it is left out. */
static void an_edge_is_a_border_only_where_the_surface_is_another(void **state)
{
    (void)state;
    assert_int_equal(found_after(false, 1.0, 10.0), 2);
    assert_int_equal(found_after(true, 1.0, 10.0), 0);
    assert_int_equal(found_after(true, exp(2.0), 10.0), 3);
}

/* Once the blocks that may ring are over, changes are looked for anywhere again, and not across the edge. */
static void behind_the_ringing_a_row_begins_anew(void **state)
{
    (void)state;
    struct numbers m;
    int after;
    struct nav_texture_change *c = make(&m, 5.0);
    for (int i = 0; i < 10; i++)
        weigh(c, 1.0, &after);
    nav_texture_change_edge(c);
    for (int i = 0; i <= NAV_TEXTURE_CHANGE_AFTER_MOST; i++)
        assert_true(ring(c, 1.0, 10.0, &after) < 5.0);
    for (int i = 0; i < 10; i++)
        assert_true(weigh(c, 1.0, &after) < (i < 3 ? -1e8 : 5.0));
    weigh(c, exp(2.0), &after);
    assert_true(weigh(c, exp(2.0), &after) > 5.0 && after == 2);
    nav_texture_change_free(c);
}

static void impossible_numbers_make_no_detector(void **state)
{
    (void)state;
    struct numbers m;
    assert_null(make(&m, NAN));
    nav_texture_change_free(NULL);
}

/* One feature, which the axis doubles; classes at 0 and 20 there, a surface never trained anywhere about 10. */
static struct nav_texture_novelty_numbers novelty_numbers(void)
{
    static const double turn[] = {2.0}, mean[] = {0.0, 20.0, 10.0}, recording[] = {1.0, 3.0, 100.0}, noise[] = {4.0};
    static const double limit[NAV_TEXTURE_NOVELTY_STEPS] = {3.0, 2.0, 1.0, 0.5, 0.25};
    return (struct nav_texture_novelty_numbers){.classes = 2,
                                                .features = 1,
                                                .turn = turn,
                                                .mean = mean,
                                                .recording = recording,
                                                .noise = noise,
                                                .limit = limit,
                                                .scale = 2.0};
}

static double log_normal(double x, double mean, double variance)
{
    return -0.5 * ((x - mean) * (x - mean) / variance + log(variance));
}

/* Log odds of windows whose turned features have this mean. */
static double novelty_wanted(double mean, int windows, double limit)
{
    double noise = 4.0 / windows, one = log_normal(mean, 0.0, 1.0 + noise), two = log_normal(mean, 20.0, 3.0 + noise);
    return (log_normal(mean, 10.0, 100.0 + noise) - fmax(one, two) - limit) / 2.0;
}

static void windows_in_a_row_are_weighed_by_their_mean(void **state)
{
    (void)state;
    const struct nav_texture_novelty_numbers n = novelty_numbers();
    struct nav_texture_novelty *v = nav_texture_novelty_new(&n);
    assert_int_equal(nav_texture_novelty_features(v), 1);
    const double x[] = {1.0, 4.0, 2.5, 2.5, 5.0}, mean[] = {2.0, 5.0, 5.0, 5.0, 6.0};
    for (int i = 0; i < 5; i++)
        assert_near(nav_texture_novelty_weigh(v, x + i),
                    novelty_wanted(mean[i], i + 1,
                                   n.limit[i < 1   ? 0
                                           : i < 3 ? 1
                                                   : 2]),
                    1e-9);
    nav_texture_novelty_reset(v);
    const double other = 9.0;
    assert_near(nav_texture_novelty_weigh(v, &other), novelty_wanted(18.0, 1, 3.0), 1e-9);
    nav_texture_novelty_free(v);
}

/* The 17th window takes a sixteenth of the mean, and so does every later one. */
static void old_windows_fade(void **state)
{
    (void)state;
    const struct nav_texture_novelty_numbers n = novelty_numbers();
    struct nav_texture_novelty *v = nav_texture_novelty_new(&n);
    const double before = 0.0, after = 5.0;
    double mean = 0.0;
    for (int i = 0; i < 40; i++)
        nav_texture_novelty_weigh(v, &before);
    for (int i = 0; i < 3; i++) {
        mean += (10.0 - mean) / 16.0;
        assert_near(nav_texture_novelty_weigh(v, &after), novelty_wanted(mean, 16, 0.25), 1e-9);
    }
    nav_texture_novelty_free(v);
}

static void impossible_numbers_make_no_novelty_detector(void **state)
{
    (void)state;
    const double nothing = 0.0, negative[] = {1.0, -1.0, 1.0}, not_finite[] = {0.0, NAN, 0.0};
    struct nav_texture_novelty_numbers n[6];
    for (int i = 0; i < 6; i++)
        n[i] = novelty_numbers();
    n[0].noise = &nothing;
    n[1].recording = negative;
    n[2].mean = not_finite;
    n[3].scale = 0.0;
    n[4].classes = 0;
    n[5].features = 0;
    for (int i = 0; i < 6; i++)
        assert_null(nav_texture_novelty_new(n + i));
    nav_texture_novelty_free(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_change_is_found_where_it_is),
        cmocka_unit_test(the_ratio_is_the_formula),
        cmocka_unit_test(a_side_that_does_not_sound_like_its_class_counts_against_the_change),
        cmocka_unit_test(a_stray_block_claims_no_more_than_the_classes_differ),
        cmocka_unit_test(what_a_drive_has_of_its_own_is_no_change),
        cmocka_unit_test(an_edge_is_a_border_only_where_the_surface_is_another),
        cmocka_unit_test(behind_the_ringing_a_row_begins_anew),
        cmocka_unit_test(impossible_numbers_make_no_detector),
        cmocka_unit_test(windows_in_a_row_are_weighed_by_their_mean),
        cmocka_unit_test(old_windows_fade),
        cmocka_unit_test(impossible_numbers_make_no_novelty_detector),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
