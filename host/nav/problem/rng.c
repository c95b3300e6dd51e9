#include "rng.h"

#include <math.h>

static uint64_t rng_splitmix(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static uint64_t rng_rotate(uint64_t x, int by)
{
    return (x << by) | (x >> (64 - by));
}

void nav_rng_seed(struct nav_rng *rng, uint64_t seed, uint64_t stream)
{
    uint64_t state = stream;
    state = rng_splitmix(&state) ^ seed;
    for (int i = 0; i < 4; i++)
        rng->state[i] = rng_splitmix(&state);
}

uint64_t nav_rng_bits(struct nav_rng *rng)
{
    uint64_t *s = rng->state, out = rng_rotate(s[0] + s[3], 23) + s[0], t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rng_rotate(s[3], 45);
    return out;
}

double nav_rng_uniform(struct nav_rng *rng)
{
    return (double)(nav_rng_bits(rng) >> 11) * 0x1p-53;
}

double nav_rng_normal(struct nav_rng *rng)
{
    /* Marsaglia's polar method; the second value is not kept, so that the state is the four words alone. */
    for (;;) {
        double u = 2.0 * nav_rng_uniform(rng) - 1.0, v = 2.0 * nav_rng_uniform(rng) - 1.0, s = u * u + v * v;
        if (s > 0.0 && s < 1.0)
            return u * sqrt(-2.0 * log(s) / s);
    }
}
