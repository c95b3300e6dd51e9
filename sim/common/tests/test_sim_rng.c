#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "near.h"
#include "sim_rng.h"

static void test_equal_names_equal_streams(void **state)
{
    (void)state;
    struct sim_rng a = sim_rng_stream(7, 1, 2), b = sim_rng_stream(7, 1, 2);
    for (int i = 0; i < 100; i++)
        assert_true(sim_rng_next(&a) == sim_rng_next(&b));
}

/* Reference output of xoshiro256** from the state 1, 2, 3, 4, as its authors' code gives it. */
static void test_generator_is_xoshiro(void **state)
{
    (void)state;
    const uint64_t wanted[] = {11520u, 0u, 1509978240u, 1215971899390074240u};
    struct sim_rng rng = {.state = {1, 2, 3, 4}};
    for (size_t i = 0; i < 4; i++)
        assert_true(sim_rng_next(&rng) == wanted[i]);
}

static double correlation(struct sim_rng a, struct sim_rng b)
{
    enum { N = 20000 };
    double sum = 0;
    for (int i = 0; i < N; i++)
        sum += sim_rng_normal(&a) * sim_rng_normal(&b) / N;
    return sum;
}

static void test_streams_are_independent(void **state)
{
    (void)state;
    struct sim_rng one = sim_rng_stream(7, 1, 2);
    assert_near(correlation(one, sim_rng_stream(7, 2, 1)), 0, 0.03);
    assert_near(correlation(one, sim_rng_stream(7, 1, 3)), 0, 0.03);
    assert_near(correlation(one, sim_rng_stream(8, 1, 2)), 0, 0.03);
    assert_near(correlation(one, one), 1, 0.05);
}

static void test_normals(void **state)
{
    (void)state;
    enum { N = 200000 };
    struct sim_rng rng = sim_rng_stream(1, 1, 1);
    double mean = 0, square = 0, fourth = 0;
    for (int i = 0; i < N; i++) {
        double x = sim_rng_normal(&rng);
        mean += x / N;
        square += x * x / N;
        fourth += x * x * x * x / N;
    }
    assert_near(mean, 0, 0.01);
    assert_near(square, 1, 0.015);
    assert_near(fourth, 3, 0.12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_equal_names_equal_streams),
        cmocka_unit_test(test_generator_is_xoshiro),
        cmocka_unit_test(test_streams_are_independent),
        cmocka_unit_test(test_normals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
