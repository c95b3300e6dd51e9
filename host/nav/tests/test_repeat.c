/* How errors of texture windows repeat: independent ones leave every window whole, runs take most of its repetitions.
 */
#include "repeat.h"

#include "near.h"
#include "rng.h"

enum { CLASSES = 3, WINDOWS = 4000, TILE = 25 };

/* Windows of a tip that crosses tiles of two classes in turn; errors begin with a chance and last `run` windows. A
 * share `expected` of a belief expects each window. Returns the mean share that a window has which says the same as the
 * one before, over the second half. */
static double mean_share(double chance, int run, double expected)
{
    struct nav_repeat r;
    struct nav_rng rng;
    assert_int_equal(nav_repeat_init(&r, 1, CLASSES, 0.5), 0);
    nav_rng_seed(&rng, 1, 0);
    int left = 0, wrong = 0, before = -1, counted = 0;
    double sum = 0.0;
    for (int k = 0; k < WINDOWS; k++) {
        int true_class = k / TILE % 2;
        if (left == 0 && nav_rng_uniform(&rng) < chance) {
            left = run;
            wrong = (true_class + 1 + (int)(nav_rng_bits(&rng) & 1)) % CLASSES;
        }
        int said = left > 0 ? wrong : true_class;
        left -= left > 0;
        double share = nav_repeat_take(&r, 0, said, 0.02, expected);
        if (said != before)
            assert_near(share, 1.0, 0.0);
        else if (k > WINDOWS / 2) {
            assert_true(share > 0.0 && share <= 1.0);
            sum += share;
            counted++;
        }
        before = said;
    }
    nav_repeat_free(&r);
    return sum / counted;
}

static void independent_windows_count_whole(void **state)
{
    (void)state;
    assert_true(mean_share(0.15, 1, 0.0) > 0.85);
}

static void errors_in_runs_make_repetitions_count_little(void **state)
{
    (void)state;
    double alone = mean_share(0.15, 1, 0.0), three = mean_share(0.05, 3, 0.0), six = mean_share(0.03, 6, 0.0);
    assert_true(three < 0.75 * alone && six < 0.35 && six < three);
}

static void another_tile_is_no_error(void **state)
{
    (void)state;
    assert_true(mean_share(0.0, 1, 0.0) > 0.2); /* nothing is learned of errors that do not occur */
}

static void runs_that_were_expected_are_tiles(void **state)
{
    (void)state;
    assert_near(mean_share(0.03, 6, 1.0), mean_share(0.0, 1, 1.0), 0.02);
}

static void one_class_is_no_trouble(void **state)
{
    (void)state;
    struct nav_repeat r;
    assert_int_equal(nav_repeat_init(&r, 1, 1, 0.5), 0);
    for (int k = 0; k < 100; k++) {
        double share = nav_repeat_take(&r, 0, 0, 0.02, 0.0);
        assert_true(share > 0.0 && share <= 1.0);
    }
    nav_repeat_free(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(independent_windows_count_whole),
        cmocka_unit_test(errors_in_runs_make_repetitions_count_little),
        cmocka_unit_test(another_tile_is_no_error),
        cmocka_unit_test(runs_that_were_expected_are_tiles),
        cmocka_unit_test(one_class_is_no_trouble),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
