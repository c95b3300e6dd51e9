#include <string.h>

#include "near.h"
#include "rng.h"
#include "texture_clean.h"
#include "texture_features.h"

enum { FEATURES_MOST = 128 };

static void draw(double *window, int n, uint64_t seed)
{
    struct nav_rng rng;
    nav_rng_seed(&rng, seed, 0);
    for (int i = 0; i < n; i++)
        window[i] = 20.0 * nav_rng_normal(&rng);
}

/* Samples less the line that fits them best, by its normal equations. */
static void straighten(const double *x, int n, double *out)
{
    double s = 0.0, si = 0.0, sii = 0.0, sx = 0.0, six = 0.0;
    for (int i = 0; i < n; i++) {
        s += 1.0;
        si += i;
        sii += (double)i * i;
        sx += x[i];
        six += i * x[i];
    }
    double slope = (s * six - si * sx) / (s * sii - si * si), level = (sx - slope * si) / s;
    for (int i = 0; i < n; i++)
        out[i] = x[i] - level - slope * i;
}

/* A log power of a band or more of the transform of n samples, as the sum written out: bins from `low` to before `high`
 * of `size`, under a Hann taper. */
static double log_power(const double *x, int n, int size, int low, int high)
{
    double taper_power = 0.0, sum = 0.0, circle = 2.0 * acos(-1.0), left[64];
    straighten(x, n, left);
    for (int k = low; k < high; k++) {
        double re = 0.0, im = 0.0;
        taper_power = 0.0;
        for (int i = 0; i < n; i++) {
            double taper = 0.5 - 0.5 * cos(circle * (i + 1) / (n + 1)), turn = circle * k * i / size;
            taper_power += taper * taper;
            re += taper * left[i] * cos(turn);
            im -= taper * left[i] * sin(turn);
        }
        sum += re * re + im * im;
    }
    return log(sum / taper_power / (high - low));
}

/* Features of one channel; returns how many. */
static int reduce(const double *window, int length, double *out)
{
    const double floor = 0.0;
    struct nav_texture_features *f = nav_texture_features_new(1, length, &floor, NULL);
    int count = nav_texture_features_count(f);
    assert_true(count <= FEATURES_MOST);
    nav_texture_features_work(f, window, out);
    nav_texture_features_free(f);
    return count;
}

static void bands_are_the_transform_written_out(void **state)
{
    (void)state;
    const int length[] = {4, 8, 50}, size[] = {4, 8, 64}, bands[] = {1, 3, 12}, counts[] = {2, 4, 13 + 2 * 7};
    const int edges[3][13] = {{1, 3}, {1, 2, 3, 5}, {1, 2, 3, 4, 5, 6, 8, 10, 13, 16, 20, 25, 33}};
    for (int s = 0; s < 3; s++) {
        double x[50], out[FEATURES_MOST], left[50], steps = 0.0;
        draw(x, length[s], (uint64_t)s);
        assert_int_equal(reduce(x, length[s], out), counts[s]);
        for (int band = 0; band < bands[s]; band++)
            assert_near(out[band], log_power(x, length[s], size[s], edges[s][band], edges[s][band + 1]), 1e-9);
        straighten(x, length[s], left);
        for (int i = 1; i < length[s]; i++)
            steps += (left[i] - left[i - 1]) * (left[i] - left[i - 1]) / (length[s] - 1);
        assert_near(out[bands[s]], log(steps), 1e-9);
    }
}

static void an_offset_and_a_drift_change_no_feature_and_a_gain_moves_all_powers_alike(void **state)
{
    (void)state;
    enum { LENGTH = 16, EACH = 7 };
    double window[2 * LENGTH], moved[2 * LENGTH], a[FEATURES_MOST], b[FEATURES_MOST];
    const double floor[] = {0.0, 0.0};
    struct nav_texture_features *f = nav_texture_features_new(2, LENGTH, floor, NULL);
    assert_int_equal(nav_texture_features_count(f), 2 * EACH + 1);
    draw(window, 2 * LENGTH, 3);
    for (int i = 0; i < 2 * LENGTH; i++)
        moved[i] = 3.0 * window[i] + 500.0 * (i % 2) + 7.0 * i;
    nav_texture_features_work(f, window, a);
    nav_texture_features_work(f, moved, b);
    for (int i = 0; i < 2 * EACH; i++)
        assert_near(b[i] - a[i], log(9.0), 1e-6);
    assert_near(b[2 * EACH], a[2 * EACH], 1e-6);
    nav_texture_features_free(f);
}

static void two_channels_correlate_as_pearson_says(void **state)
{
    (void)state;
    enum { LENGTH = 16 };
    double window[2 * LENGTH], one[LENGTH], other[LENGTH], out[FEATURES_MOST], xy = 0.0, xx = 0.0, yy = 0.0;
    const double floor[] = {0.0, 0.0};
    struct nav_texture_features *f = nav_texture_features_new(2, LENGTH, floor, NULL);
    draw(window, 2 * LENGTH, 4);
    for (int i = 0; i < LENGTH; i++) {
        window[2 * i + 1] += 0.5 * window[2 * i];
        one[i] = window[2 * i];
        other[i] = window[2 * i + 1];
    }
    straighten(one, LENGTH, one);
    straighten(other, LENGTH, other);
    for (int i = 0; i < LENGTH; i++) {
        xy += one[i] * other[i];
        xx += one[i] * one[i];
        yy += other[i] * other[i];
    }
    nav_texture_features_work(f, window, out);
    assert_near(out[nav_texture_features_count(f) - 1], atanh(xy / sqrt(xx * yy)), 1e-9);
    nav_texture_features_free(f);
}

/* Eight of two ninths, each half over the next: the mean of what each alone would say, then the spread. */
static void stretches_are_the_windows_that_they_would_be_alone(void **state)
{
    (void)state;
    enum { PARTS = 8, STRETCH = 10, LENGTH = 9 * STRETCH / 2, WHOLE = 13, EACH = 7 };
    double window[LENGTH], out[FEATURES_MOST], alone[PARTS][FEATURES_MOST];
    draw(window, LENGTH, 5);
    assert_int_equal(reduce(window, LENGTH, out), WHOLE + 2 * EACH);
    for (int i = 0; i < PARTS; i++)
        assert_int_equal(reduce(window + i * STRETCH / 2, STRETCH, alone[i]), EACH);
    for (int c = 0; c < EACH; c++) {
        double mean = 0.0, squares = 0.0;
        for (int i = 0; i < PARTS; i++)
            mean += alone[i][c] / PARTS;
        for (int i = 0; i < PARTS; i++)
            squares += (alone[i][c] - mean) * (alone[i][c] - mean) / PARTS;
        assert_near(out[WHOLE + c], mean, 1e-9);
        assert_near(out[WHOLE + EACH + c], sqrt(squares), 1e-9);
    }
}

/* A knock among quiet samples: the steps of the whole are the knock's, the mean of the stretches stays near the quiet.
 */
static void a_knock_moves_the_stretches_less_than_the_whole(void **state)
{
    (void)state;
    enum { LENGTH = 128 };
    double window[LENGTH], quiet[FEATURES_MOST], knocked[FEATURES_MOST];
    draw(window, LENGTH, 9);
    int count = reduce(window, LENGTH, quiet), each = 10, whole = count - 2 * each;
    window[100] += 2000.0;
    reduce(window, LENGTH, knocked);
    int steps = whole - 1, mean = whole + each - 1, spread = count - 1;
    double moved = knocked[steps] - quiet[steps];
    assert_true(moved > 4.0);
    assert_true(knocked[mean] - quiet[mean] < 0.4 * moved);
    assert_true(knocked[spread] > quiet[spread] + 1.0);
}

static void a_constant_window_has_finite_features(void **state)
{
    (void)state;
    double window[3 * 24] = {0.0}, out[FEATURES_MOST];
    const double floor[] = {0.0, 0.0, 0.0}, negative[] = {0.0, -1.0, 0.0};
    struct nav_texture_features *f = nav_texture_features_new(3, 24, floor, NULL);
    nav_texture_features_work(f, window, out);
    for (int i = 0; i < nav_texture_features_count(f); i++)
        assert_true(isfinite(out[i]));
    nav_texture_features_free(f);
    assert_null(nav_texture_features_new(3, 7, negative, NULL));
    assert_null(nav_texture_features_new(3, NAV_TEXTURE_LENGTH_MIN - 1, floor, NULL));
    assert_null(nav_texture_features_new(0, 7, floor, NULL));
}

static void missing_samples_and_spikes_are_bridged_and_counted(void **state)
{
    (void)state;
    const double spike = 50.0;
    const struct nav_texture_limits limits = {.channels = 1, .spike = &spike};
    double x[] = {NAN, 2.0, 3.0, 400.0, 5.0, INFINITY, NAN, 8.0, 1e300};
    const double wanted[] = {2.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 8.0};
    struct nav_texture_health health = nav_texture_clean(x, 9, &limits);
    assert_int_equal(health.bad, 5);
    for (int i = 0; i < 9; i++)
        assert_near(x[i], wanted[i], 1e-12);
    double none[] = {NAN, NAN};
    assert_int_equal(nav_texture_clean(none, 2, &limits).bad, 2);
    assert_true(none[0] == 0.0 && none[1] == 0.0);
}

static void stuck_railed_and_caught_channels_are_reported(void **state)
{
    (void)state;
    const double still[] = {3.0, 3.0}, low[] = {0.0, 0.0}, high[] = {100.0, 100.0}, span[] = {60.0, 60.0};
    const struct nav_texture_limits limits = {.channels = 2, .still = still, .low = low, .high = high, .span = span};
    double well[] = {10, 50, 11, 51, 12, 50, 12, 49, 10, 55};
    double ill[] = {10, 10, 10, 100, 10, 100, 10, 20, 11, 15};
    struct nav_texture_health h = nav_texture_clean(well, 5, &limits);
    assert_true(!h.bad && !h.still && !h.railed && !h.caught);
    h = nav_texture_clean(ill, 5, &limits);
    assert_int_equal(h.still, 1);
    assert_int_equal(h.railed, 1);
    assert_int_equal(h.caught, 1);
}

static int railed(double first, double second, double third)
{
    const double low = 0.0, high = 100.0;
    const struct nav_texture_limits limits = {.channels = 1, .low = &low, .high = &high};
    double window[] = {first, second, third};
    return nav_texture_clean(window, 3, &limits).railed;
}

static void two_samples_at_or_beyond_a_stop_are_a_rail(void **state)
{
    (void)state;
    assert_int_equal(railed(50.0, 0.0, 0.0), 1);
    assert_int_equal(railed(100.0, 100.0, 50.0), 1);
    assert_int_equal(railed(-7.0, -5.0, 50.0), 1);
    assert_int_equal(railed(50.0, 105.0, 107.0), 1);
    assert_int_equal(railed(0.0, 50.0, 0.0), 0);
    assert_int_equal(railed(50.0, 1.0, 1.0), 0);
    assert_int_equal(railed(99.0, 99.0, 50.0), 0);
}

/* The shares of kernels of a window, which are its last features. */
static void shares(int channels, int length, const double *window, const double *threshold, double *out)
{
    const double floor[] = {0.0, 0.0};
    double all[4 * FEATURES_MOST];
    struct nav_texture_features *f = nav_texture_features_new(channels, length, floor, threshold);
    int count = nav_texture_shape_count(length), before = nav_texture_features_count(f) - count;
    nav_texture_features_work(f, window, all);
    memcpy(out, all + before, (size_t)count * sizeof *out);
    nav_texture_features_free(f);
}

/* 84 kernels on one channel of 9 samples, each in one place: above a threshold or not, as the sum written out. */
static void shapes_are_shares_of_places_above_a_threshold(void **state)
{
    (void)state;
    enum { TAPS = 9, KERNELS = 84 };
    const double x[TAPS] = {3.0, -1.0, 4.0, -1.0, -5.0, 9.0, -2.0, -6.0, -1.0};
    double threshold[KERNELS], out[KERNELS], left[TAPS];
    straighten(x, TAPS, left);
    assert_int_equal(nav_texture_shape_count(TAPS - 1), 0);
    assert_int_equal(nav_texture_shape_count(TAPS), KERNELS);
    assert_int_equal(nav_texture_shape_count(2 * TAPS), 2 * KERNELS);
    for (int k = 0; k < KERNELS; k++)
        threshold[k] = k % 5 * 6.0 - 12.1;
    shares(1, TAPS, x, threshold, out);
    int kernel = 0;
    for (int a = 0; a < TAPS; a++) {
        for (int b = a + 1; b < TAPS; b++) {
            for (int c = b + 1; c < TAPS; c++, kernel++) {
                double sum = 0.0;
                for (int i = 0; i < TAPS; i++)
                    sum += left[i] * (i == a || i == b || i == c ? 2.0 : -1.0);
                assert_true(out[kernel] == (sum > threshold[kernel] ? 1.0 : 0.0));
            }
        }
    }
    const double floor = 0.0;
    assert_null(nav_texture_features_new(1, TAPS - 1, &floor, threshold));
    threshold[3] = NAN;
    assert_null(nav_texture_features_new(1, TAPS, &floor, threshold));
}

/* Of two channels each kernel looks at one, in turn: changing a channel changes every other number of a spread. */
static void kernels_take_the_channels_in_turn(void **state)
{
    (void)state;
    enum { LENGTH = 18, KERNELS = 84 };
    double x[2 * LENGTH], threshold[2 * KERNELS] = {0.0}, one[2 * KERNELS], other[2 * KERNELS];
    for (int i = 0; i < 2 * LENGTH; i++)
        x[i] = sin(1.0 + 2.3 * i * i);
    shares(2, LENGTH, x, threshold, one);
    for (int i = 0; i < LENGTH; i++)
        x[2 * i] = -x[2 * i]; /* a share above 0 becomes one below it */
    shares(2, LENGTH, x, threshold, other);
    for (int k = 0; k < 2 * KERNELS; k++)
        assert_near(other[k], (k % KERNELS + k / KERNELS) % 2 == 0 ? 1.0 - one[k] : one[k], 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shapes_are_shares_of_places_above_a_threshold),
        cmocka_unit_test(kernels_take_the_channels_in_turn),
        cmocka_unit_test(bands_are_the_transform_written_out),
        cmocka_unit_test(an_offset_and_a_drift_change_no_feature_and_a_gain_moves_all_powers_alike),
        cmocka_unit_test(two_channels_correlate_as_pearson_says),
        cmocka_unit_test(stretches_are_the_windows_that_they_would_be_alone),
        cmocka_unit_test(a_knock_moves_the_stretches_less_than_the_whole),
        cmocka_unit_test(a_constant_window_has_finite_features),
        cmocka_unit_test(missing_samples_and_spikes_are_bridged_and_counted),
        cmocka_unit_test(two_samples_at_or_beyond_a_stop_are_a_rail),
        cmocka_unit_test(stuck_railed_and_caught_channels_are_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
