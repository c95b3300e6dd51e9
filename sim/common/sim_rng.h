/* Random numbers: xoshiro256** (Blackman and Vigna 2018), one stream per purpose. */
#ifndef SIM_RNG_H
#define SIM_RNG_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct sim_rng {
    uint64_t state[4];
};

/* The next number of splitmix64 (Steele, Lea, Flood 2014) from a state of 64 bits: seeds, and draws of tests. */
uint64_t sim_rng_mix(uint64_t *state);

/* The next state of Knuth's generator MMIX, whose top bits are random: for models that keep 64 bits of state. */
uint64_t sim_rng_mmix(uint64_t *state);

/* Starts the stream that (seed, purpose, index) names: streams with different names are independent. */
struct sim_rng sim_rng_stream(uint64_t seed, uint32_t purpose, uint32_t index);

uint64_t sim_rng_next(struct sim_rng *rng);

/* Uniform in [0, 1), 53 bits. */
double sim_rng_uniform(struct sim_rng *rng);

/* Normal with mean 0 and standard deviation 1 (the ziggurat of Marsaglia and Tsang 2000, 256 layers). */
double sim_rng_normal(struct sim_rng *rng);

#ifdef __cplusplus
}
#endif

#endif
