#include "contact.h"

#include "near.h"

static const struct nav_contact_config CONFIG = {.onset_counts = 100.0,
                                                 .release_counts = 50.0,
                                                 .onset_samples = 2,
                                                 .release_samples = 3,
                                                 .settle_samples = 4,
                                                 .rest_samples = 10.0};

static struct nav_contact settled(void)
{
    struct nav_contact c;
    nav_contact_init(&c, &CONFIG);
    for (int i = 0; i < CONFIG.settle_samples; i++)
        nav_contact_update(&c, 1000.0, 2000.0, true);
    return c;
}

static enum nav_contact_event push(struct nav_contact *c, double deflection)
{
    return nav_contact_update(c, 1000.0 + 0.6 * deflection, 2000.0 - 0.8 * deflection, true);
}

static void rest_is_the_mean_of_the_first_good_samples(void **state)
{
    (void)state;
    struct nav_contact c;
    nav_contact_init(&c, &CONFIG);
    const double alpha[] = {1.0, 3.0, 5.0, 7.0};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(nav_contact_update(&c, alpha[i], 9.0, true), NAV_CONTACT_NONE);
        nav_contact_update(&c, 1e6, 1e6, false);
    }
    assert_near(c.rest[0], 4.0, 1e-12);
    assert_near(c.rest[1], 9.0, 1e-12);
    assert_int_equal(c.skipped, 4);
}

static void contact_begins_after_the_run_and_ends_after_the_other(void **state)
{
    (void)state;
    struct nav_contact c = settled();
    const double deflection[] = {120, 0, 120, 150, 130, 70, 40, 60, 40, 40, 40};
    const enum nav_contact_event expected[] = {0, 0, 0, NAV_CONTACT_ONSET, 0, 0, 0, 0, 0, 0, NAV_CONTACT_RELEASE};
    for (int i = 0; i < 11; i++)
        assert_int_equal(push(&c, deflection[i]), expected[i]);
    assert_near(c.peak, 150.0, 1e-9);
    assert_false(c.touching);
}

static void bad_samples_neither_begin_keep_nor_end_a_contact(void **state)
{
    (void)state;
    struct nav_contact c = settled();
    push(&c, 120);
    assert_int_equal(nav_contact_update(&c, 9e9, 0, false), NAV_CONTACT_NONE);
    assert_int_equal(nav_contact_update(&c, (double)NAN, 0, true), NAV_CONTACT_NONE);
    assert_int_equal(push(&c, 120), NAV_CONTACT_ONSET);
    assert_near(c.peak, 120.0, 1e-9);
    assert_int_equal(c.skipped, 2);
}

static void rest_follows_drift_only_while_nothing_touches(void **state)
{
    (void)state;
    struct nav_contact c = settled();
    nav_contact_update(&c, 1010.0, 2000.0, true);
    assert_near(c.rest[0], 1001.0, 1e-12);
    push(&c, 120);
    push(&c, 120);
    double rest = c.rest[0];
    for (int i = 0; i < 100; i++)
        push(&c, 120);
    assert_near(c.rest[0], rest, 0.0);
    assert_true(c.touching);
}

static void a_block_of_samples_gives_the_same_events(void **state)
{
    (void)state;
    struct nav_contact c = settled();
    const double samples[] = {1200, 2000, 1200, 2000, 1300, 2000, 1000, 2000, 1000, 2000, 1000, 2000};
    const uint8_t good[] = {1, 1, 1, 1, 1, 1};
    uint8_t events[6];
    double peaks[6];
    nav_contact_run(&c, samples, good, 6, events, peaks);
    assert_int_equal(events[1], NAV_CONTACT_ONSET);
    assert_int_equal(events[5], NAV_CONTACT_RELEASE);
    assert_near(peaks[5], 300.0, 1e-9);
    assert_near(peaks[4], 0.0, 0.0);
}

/* As in the pilot at 2 kHz, with noise of 11 counts. */
struct ramp {
    struct nav_contact c;
    double level;
    uint32_t noise;
};

static struct ramp pilots(void)
{
    static const struct nav_contact_config config = {.onset_counts = 110.0,
                                                     .release_counts = 65.0,
                                                     .onset_samples = 3,
                                                     .release_samples = 12,
                                                     .settle_samples = 1,
                                                     .rest_samples = 40000.0};
    struct ramp r = {.noise = 1};
    nav_contact_init(&r.c, &config);
    nav_contact_update(&r.c, 0.0, 0.0, true);
    return r;
}

static double noise_of(struct ramp *r)
{
    double sum = 0.0;
    for (int i = 0; i < 12; i++) {
        r->noise = r->noise * 1664525u + 1013904223u;
        sum += (double)(r->noise >> 8) / 16777216.0;
    }
    return 11.0 * (sum - 6.0);
}

/* Ramps by `per_second` counts for `seconds`; returns how many events came. */
static int go(struct ramp *r, double per_second, double seconds)
{
    int events = 0;
    for (int i = 0; i < (int)(2000.0 * seconds); i++) {
        r->level += per_second / 2000.0;
        double beta = noise_of(r);
        events += nav_contact_update(&r->c, r->level + noise_of(r), beta, true) != NAV_CONTACT_NONE;
    }
    return events;
}

static void a_rest_that_drifts_past_the_release_threshold_is_no_contact(void **state)
{
    (void)state;
    struct ramp r = pilots();
    assert_int_equal(go(&r, 12.0, 120.0), 0); /* at a time constant of 20 s it lags by 240 counts if nothing else */
    assert_true(fabs(r.level - r.c.rest[0]) < 110.0);
    r.level += 400.0;
    assert_int_equal(go(&r, 0.0, 0.5), 1);
    assert_true(r.c.touching);
    r.level -= 400.0;
    go(&r, 0.0, 3.0);
    assert_false(r.c.touching);
    assert_int_equal(go(&r, 0.0, 60.0), 0);
    assert_near(r.c.rest[0], r.level, 10.0);
}

static void a_contact_ends_although_the_rest_has_drifted_meanwhile(void **state)
{
    (void)state;
    struct ramp r = pilots();
    r.level = 500.0;
    assert_int_equal(go(&r, 8.0, 10.0), 1);
    r.level -= 500.0;
    assert_int_equal(go(&r, 0.0, 3.0), 1);
    assert_false(r.c.touching);
    assert_int_equal(go(&r, 0.0, 60.0), 0);
    assert_near(r.c.rest[0], 80.0, 10.0);
}

static void a_soft_press_moves_the_rest_by_less_than_the_release_threshold(void **state)
{
    (void)state;
    struct ramp r = pilots();
    r.level = 85.0;
    assert_int_equal(go(&r, 0.0, 5.0), 0);
    assert_true(fabs(r.c.rest[0]) < 65.0);
    r.level = 0.0;
    assert_int_equal(go(&r, 0.0, 60.0), 0);
    assert_near(r.c.rest[0], 0.0, 10.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rest_is_the_mean_of_the_first_good_samples),
        cmocka_unit_test(contact_begins_after_the_run_and_ends_after_the_other),
        cmocka_unit_test(bad_samples_neither_begin_keep_nor_end_a_contact),
        cmocka_unit_test(rest_follows_drift_only_while_nothing_touches),
        cmocka_unit_test(a_rest_that_drifts_past_the_release_threshold_is_no_contact),
        cmocka_unit_test(a_contact_ends_although_the_rest_has_drifted_meanwhile),
        cmocka_unit_test(a_soft_press_moves_the_rest_by_less_than_the_release_threshold),
        cmocka_unit_test(a_block_of_samples_gives_the_same_events),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
