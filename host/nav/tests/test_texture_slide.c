#include "texture_slide.h"

#include <string.h>

#include "near.h"
#include "rng.h"

enum { WHISKERS = 3, AXES = 2, WINDOW = 50, SAMPLES = 400, CLASSES = 2 };

static struct nav_texture *trained(struct nav_rng *rng)
{
    const double low[] = {-4.0, -4.0}, high[] = {4.0, 4.0};
    struct nav_texture *t = nav_texture_new(CLASSES, AXES, 16, low, high);
    for (int i = 0; i < 500; i++) {
        const double calm[] = {0.5 * nav_rng_normal(rng), nav_rng_normal(rng)};
        const double rough[] = {2.0 * nav_rng_normal(rng), 1.0 + nav_rng_normal(rng)};
        nav_texture_add(t, 0, calm, 1);
        nav_texture_add(t, 1, rough, 1);
    }
    nav_texture_finish(t, 1.0);
    return t;
}

/* Samples of three whiskers, one in twenty missing. */
static void draw(struct nav_rng *rng, double *samples)
{
    for (int i = 0; i < SAMPLES * WHISKERS * AXES; i++)
        samples[i] = nav_rng_uniform(rng) < 0.05 ? NAN : 1.5 * nav_rng_normal(rng);
}

static void every_window_equals_equation_1_over_the_same_samples(void **state)
{
    (void)state;
    static double samples[SAMPLES * WHISKERS * AXES];
    struct nav_rng rng;
    nav_rng_seed(&rng, 5, 0);
    struct nav_texture *t = trained(&rng);
    struct nav_texture_slide *s = nav_texture_slide_new(t, WHISKERS, WINDOW);
    draw(&rng, samples);
    for (int n = 1; n <= SAMPLES; n++) {
        nav_texture_slide_push(s, samples + (n - 1) * WHISKERS * AXES, 1);
        int from = n > WINDOW ? n - WINDOW : 0;
        for (int w = 0; w < WHISKERS; w++) {
            double window[WINDOW * AXES], slid[CLASSES], whole[CLASSES];
            for (int i = from; i < n; i++)
                memcpy(window + (i - from) * AXES, samples + (i * WHISKERS + w) * AXES, AXES * sizeof *window);
            size_t used = nav_texture_loglik(t, window, (size_t)(n - from), whole);
            assert_int_equal(nav_texture_slide_loglik(s, w, slid), used);
            assert_near(slid[0], whole[0], 1e-7);
            assert_near(slid[1], whole[1], 1e-7);
        }
    }
    nav_texture_slide_free(s);
    nav_texture_free(t);
}

static void missing_samples_are_counted_and_the_sum_comes_back_to_nought(void **state)
{
    (void)state;
    struct nav_rng rng;
    nav_rng_seed(&rng, 6, 0);
    struct nav_texture *t = trained(&rng);
    struct nav_texture_slide *s = nav_texture_slide_new(t, 1, 10);
    double sample[AXES] = {0.3, 0.2}, loglik[CLASSES];
    for (int i = 0; i < 100000; i++) {
        sample[0] = nav_rng_normal(&rng);
        nav_texture_slide_push(s, sample, 1);
    }
    sample[1] = INFINITY;
    for (int i = 0; i < 10; i++)
        nav_texture_slide_push(s, sample, 1);
    assert_int_equal(nav_texture_slide_loglik(s, 0, loglik), 0);
    assert_true(loglik[0] == 0.0 && loglik[1] == 0.0);
    assert_int_equal(nav_texture_slide_bad(s, 0), 10);
    nav_texture_slide_free(s);
    nav_texture_free(t);
}

static void after_a_reset_only_the_samples_since_count(void **state)
{
    (void)state;
    static double samples[SAMPLES * WHISKERS * AXES];
    struct nav_rng rng;
    nav_rng_seed(&rng, 8, 0);
    struct nav_texture *t = trained(&rng);
    struct nav_texture_slide *s = nav_texture_slide_new(t, WHISKERS, WINDOW);
    struct nav_texture_slide *fresh = nav_texture_slide_new(t, WHISKERS, WINDOW);
    draw(&rng, samples);
    nav_texture_slide_push(s, samples, SAMPLES - WINDOW / 2);
    nav_texture_slide_reset(s);
    for (int n = 0; n < 2 * WINDOW; n++) {
        nav_texture_slide_push(s, samples + n * WHISKERS * AXES, 1);
        nav_texture_slide_push(fresh, samples + n * WHISKERS * AXES, 1);
        for (int w = 0; w < WHISKERS; w++) {
            double again[CLASSES], first[CLASSES];
            assert_int_equal(nav_texture_slide_loglik(s, w, again), nav_texture_slide_loglik(fresh, w, first));
            assert_memory_equal(again, first, sizeof first);
        }
    }
    nav_texture_slide_free(fresh);
    nav_texture_slide_free(s);
    nav_texture_free(t);
}

static void impossible_sizes_make_no_window(void **state)
{
    (void)state;
    struct nav_rng rng;
    nav_rng_seed(&rng, 7, 0);
    struct nav_texture *t = trained(&rng);
    assert_null(nav_texture_slide_new(t, 0, 10));
    assert_null(nav_texture_slide_new(t, 1, 0));
    assert_null(nav_texture_slide_new(t, 1, NAV_TEXTURE_SLIDE_MAX + 1));
    nav_texture_slide_free(NULL);
    nav_texture_free(t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_window_equals_equation_1_over_the_same_samples),
        cmocka_unit_test(missing_samples_are_counted_and_the_sum_comes_back_to_nought),
        cmocka_unit_test(after_a_reset_only_the_samples_since_count),
        cmocka_unit_test(impossible_sizes_make_no_window),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
