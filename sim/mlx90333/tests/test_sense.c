/* From the field to the words: transfer, conversions, filter, noise. */
#include "bench.h"

#include <math.h>

static void counts_follow_the_transfer(void **state)
{
    (void)state;
    assert_int_equal(sim_counts(0.0), 0x8000);
    assert_int_equal(sim_counts(45.0), 0xC000);
    assert_int_equal(sim_counts(-45.0), 0x4000);
    assert_int_equal(sim_counts(-90.0), 0);
    assert_int_equal(sim_counts(90.0), 0xFFF0);
    assert_int_equal(sim_counts(1e300), 0xFFF0);
    assert_int_equal(sim_counts(-1e300), 0);
    assert_int_equal(sim_counts(1.0), 0x8000 + 368); /* 364.09 counts: the nearest multiple of 16 */
    assert_int_equal(sim_counts(-1.0), 0x8000 - 368);
}

static void counts_never_fall_and_stay_within_half_a_step(void **state)
{
    (void)state;
    uint16_t before = 0;
    for (double deg = -90.0; deg < 89.9; deg += 0.003) {
        const uint16_t counts = sim_counts(deg);
        const double error = counts - (0x8000 + deg * 65536.0 / 180.0);
        assert_true(counts >= before && counts % 16 == 0);
        assert_true(error >= -8.0001 && error <= 8.0001);
        before = counts;
    }
}

static void readings_are_up_to_one_conversion_old(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.conversion_ns = 350000;
    p.step_counts = 1;
    p.seed = 5;
    struct bench bench;
    wake_as(&bench, &p);
    uint64_t least = UINT64_MAX, most = 0;
    for (int i = 0; i < 200; i++) {
        const struct mlx90333_field field = {.since_ns = bench.now, .alpha_deg_s = 1000.0};
        const uint64_t since = bench.now;
        mlx90333_set_field(&bench.sensor, &field);
        const uint64_t latch = bench.now + 7u * bench.period + bench.period / 2;
        const unsigned alpha = alpha_of(&bench);
        const uint64_t age = bench.sensor.age_ns;
        least = age < least ? age : least;
        most = age > most ? age : most;
        if (latch - age > since) /* converted since the ramp began */
            assert_true(alpha - mlx90333_counts(&p, (double)(latch - age - since) * 1e-6) + 2u < 4u);
        bench.now += 123456;
    }
    assert_true(least < 20000 && most > 330000 && most < 350000);
}

static void filters_average_the_newest_conversions(void **state)
{
    (void)state;
    const double reduction_db[] = {0.0, 2.9, 4.0, 4.7, 5.6, 6.2}; /* the data sheet's column */
    double plain = 0.0;
    for (uint8_t filter = 0; filter <= 5; filter++) {
        struct mlx90333_parameters p = standard();
        p.conversion_ns = 60000;
        p.step_counts = 1;
        p.noise_deg = 1.0;
        p.filter = filter;
        struct bench bench;
        wake_as(&bench, &p);
        double sum = 0.0, squares = 0.0;
        for (int i = 0; i < 4000; i++) {
            const double a = alpha_of(&bench);
            sum += a;
            squares += a * a;
            bench.now += 700000; /* more than the taps reach */
        }
        const double deviation = sqrt(squares / 4000 - sum / 4000 * (sum / 4000));
        plain = filter == 0 ? deviation : plain;
        assert_true(fabs(20.0 * log10(plain / deviation) - reduction_db[filter]) < 0.45);
    }
}

static void the_span_sets_the_counts_of_a_degree(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.step_counts = 1;
    assert_int_equal(mlx90333_counts(&p, 45.0), 0xC000);
    p.span_deg = 360.0;
    assert_int_equal(mlx90333_counts(&p, 45.0), 0xA000);
    p.span_deg = 90.0;
    assert_int_equal(mlx90333_counts(&p, 22.5), 0xC000);
    assert_int_equal(mlx90333_counts(&p, 60.0), 0xFFFF);
}

static void the_resolution_rounds_to_its_steps(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.step_counts = 1;
    assert_int_equal(mlx90333_counts(&p, 1.0), 0x8000 + 364); /* 364.09 */
    p.step_counts = 16;
    assert_int_equal(mlx90333_counts(&p, 1.0), 0x8000 + 368);
    p.step_counts = 256;
    assert_int_equal(mlx90333_counts(&p, 1.0), 0x8000 + 256);
}

/* Deviation of 4000 readings of a field at rest, degrees. */
static double deviation(const struct mlx90333_parameters *p)
{
    struct bench bench;
    double sum = 0.0, squares = 0.0;
    wake_as(&bench, p);
    for (int i = 0; i < 4000; i++) {
        const double deg = ((double)alpha_of(&bench) - 32768.0) * 180.0 / 65536.0;
        sum += deg;
        squares += deg * deg;
    }
    return sqrt(squares / 4000 - sum / 4000 * (sum / 4000));
}

static void noise_is_as_large_as_reported_and_seeded(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.step_counts = 1;
    p.seed = 3;
    assert_true(deviation(&p) == 0.0);
    p.noise_deg = 0.05;
    const double once = deviation(&p);
    assert_true(fabs(once / 0.05 - 1.0) < 0.05);
    assert_true(deviation(&p) == once);
    p.seed = 4;
    assert_true(deviation(&p) != once);
}

static void without_conversions_of_its_own_a_reading_is_as_at_the_latch(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    for (int i = 0; i < 20; i++) {
        set_field(&bench, i, 0.0);
        assert_int_equal(alpha_of(&bench), sim_counts(i));
        assert_int_equal(bench.sensor.age_ns, 0);
        bench.now += 77777;
    }
}

/* The largest age seen is the period, whatever it is, stretched by the oscillator. */
static void the_conversion_period_bounds_the_age(void **state)
{
    (void)state;
    const uint32_t period_ns[] = {200000, 350000, 600000, 1500000};
    for (unsigned i = 0; i < 8; i++) {
        struct mlx90333_parameters p = standard();
        p.conversion_ns = period_ns[i / 2];
        p.slow_permille = i % 2 ? 1100 : 900;
        const uint64_t period = (uint64_t)p.conversion_ns * p.slow_permille / 1000u;
        struct mlx90333_sense sense = {0};
        uint64_t most = 0;
        uint16_t words[2];
        mlx90333_sense_start(&sense, &p, 0);
        for (uint64_t n = 10; n < 400; n++) {
            const uint64_t age = mlx90333_sense_latch(&sense, n * 365123u, words);
            most = age > most ? age : most;
        }
        assert_true(most < period && most > period - period / 20u);
    }
}

static void the_phase_of_the_conversions_differs_from_part_to_part(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    uint64_t age[2];
    p.conversion_ns = 350000;
    for (unsigned i = 0; i < 2; i++) {
        struct bench bench;
        p.seed = i + 1u;
        wake_as(&bench, &p);
        alpha_of(&bench);
        age[i] = bench.sensor.age_ns;
    }
    assert_true(age[0] != age[1]);
}

/* A step of the field reaches a filtered reading after as many conversions as the filter has taps. */
static void a_step_takes_as_many_conversions_as_the_filter_has_taps(void **state)
{
    (void)state;
    const unsigned taps[] = {1, 2, 3, 4, 4, 5};
    for (uint8_t filter = 0; filter <= 5; filter++) {
        struct mlx90333_parameters p = standard();
        p.conversion_ns = 350000;
        p.step_counts = 1;
        p.filter = filter;
        struct mlx90333_sense sense = {0};
        uint16_t words[2];
        mlx90333_sense_start(&sense, &p, 0);
        mlx90333_sense_latch(&sense, 10u * 350000u, words);
        const struct mlx90333_field field = {.since_ns = 10u * 350000u, .alpha_deg = 20.0};
        mlx90333_sense_field(&sense, &field);
        unsigned conversions = 0;
        for (; words[0] != mlx90333_counts(&p, 20.0); conversions++)
            mlx90333_sense_latch(&sense, (11u + conversions) * 350000u, words);
        assert_int_equal(conversions, taps[filter]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(counts_follow_the_transfer),
        cmocka_unit_test(counts_never_fall_and_stay_within_half_a_step),
        cmocka_unit_test(readings_are_up_to_one_conversion_old),
        cmocka_unit_test(filters_average_the_newest_conversions),
        cmocka_unit_test(the_span_sets_the_counts_of_a_degree),
        cmocka_unit_test(the_resolution_rounds_to_its_steps),
        cmocka_unit_test(noise_is_as_large_as_reported_and_seeded),
        cmocka_unit_test(without_conversions_of_its_own_a_reading_is_as_at_the_latch),
        cmocka_unit_test(the_conversion_period_bounds_the_age),
        cmocka_unit_test(the_phase_of_the_conversions_differs_from_part_to_part),
        cmocka_unit_test(a_step_takes_as_many_conversions_as_the_filter_has_taps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
