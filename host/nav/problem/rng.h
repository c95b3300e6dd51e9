/* Pseudo-random numbers, the same from the same seed on every run: xoshiro256++ (Blackman and Vigna), seeded through
 * splitmix64. */
#ifndef NAV_RNG_H
#define NAV_RNG_H

#include <stdint.h>

struct nav_rng {
    uint64_t state[4];
};

/* Any seed will do, 0 too. `stream`: independent sequences of one seed. */
void nav_rng_seed(struct nav_rng *, uint64_t seed, uint64_t stream);

/* 64 random bits. */
uint64_t nav_rng_bits(struct nav_rng *);

/* Uniform in 0 <= u < 1, in steps of 2^-53. */
double nav_rng_uniform(struct nav_rng *);

/* Standard normal. */
double nav_rng_normal(struct nav_rng *);

/* Nearly standard normal, and quick: the sum of four uniforms of 16 bits, which ends at 3.46 standard deviations. */
static inline double nav_rng_rough(struct nav_rng *rng)
{
    uint64_t bits = nav_rng_bits(rng);
    uint32_t sum = (uint32_t)(bits & 0xffff) + (uint32_t)(bits >> 16 & 0xffff) + (uint32_t)(bits >> 32 & 0xffff) +
                   (uint32_t)(bits >> 48);
    /* Four uniform numbers of 0 .. 65535: mean 131070, variance (65536^2 - 1) / 3. */
    return ((double)sum - 131070.0) * (1.0 / 37837.22);
}

#endif
