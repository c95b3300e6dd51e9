#include "rng.h"

#include "near.h"

static void the_generator_is_xoshiro256_plus_plus(void **state)
{
    (void)state;
    /* From the state 1, 2, 3, 4: by hand, rotate(1 + 4, 23) + 1; the state is then 7, 0, 131074, 6 rotated by 45. */
    struct nav_rng rng = {{1, 2, 3, 4}};
    assert_true(nav_rng_bits(&rng) == 41943041u);
    assert_true(rng.state[0] == 7 && rng.state[1] == 0 && rng.state[2] == (2ull | 1ull << 18));
    assert_true(rng.state[3] == 6ull << 45);
    assert_true(nav_rng_bits(&rng) == (((7 + (6ull << 45)) << 23) | ((7 + (6ull << 45)) >> 41)) + 7);
}

static void a_seed_gives_one_sequence_and_streams_differ(void **state)
{
    (void)state;
    struct nav_rng a, b, other, stream;
    nav_rng_seed(&a, 0, 0);
    nav_rng_seed(&b, 0, 0);
    nav_rng_seed(&other, 1, 0);
    nav_rng_seed(&stream, 0, 1);
    for (int i = 0; i < 100; i++) {
        uint64_t bits = nav_rng_bits(&a);
        assert_true(bits == nav_rng_bits(&b));
        assert_true(bits != nav_rng_bits(&other) && bits != nav_rng_bits(&stream));
    }
}

static void uniform_and_normal_have_their_moments(void **state)
{
    (void)state;
    enum { DRAWS = 200000 };
    struct nav_rng rng;
    nav_rng_seed(&rng, 7, 0);
    double mean = 0.0, normal[5] = {0.0};
    int beyond = 0;
    for (int i = 0; i < DRAWS; i++) {
        double u = nav_rng_uniform(&rng), z = nav_rng_normal(&rng), power = 1.0;
        assert_true(u >= 0.0 && u < 1.0);
        mean += u / DRAWS;
        for (int k = 0; k < 5; k++, power *= z)
            normal[k] += power / DRAWS;
        beyond += fabs(z) > 1.959964;
    }
    /* Five standard errors. */
    assert_near(mean, 0.5, 5.0 * 0.2887 / sqrt(DRAWS));
    assert_near(normal[1], 0.0, 5.0 / sqrt(DRAWS));
    assert_near(normal[2], 1.0, 5.0 * sqrt(2.0 / DRAWS));
    assert_near(normal[3], 0.0, 5.0 * sqrt(15.0 / DRAWS));
    assert_near(normal[4], 3.0, 5.0 * sqrt(96.0 / DRAWS));
    assert_near((double)beyond / DRAWS, 0.05, 5.0 * 0.218 / sqrt(DRAWS));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_generator_is_xoshiro256_plus_plus),
        cmocka_unit_test(a_seed_gives_one_sequence_and_streams_differ),
        cmocka_unit_test(uniform_and_normal_have_their_moments),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
