#include "sim_rng.h"

#include <math.h>

/* splitmix64: spreads a seed over the state, as the authors of xoshiro advise. */
static uint64_t spread(uint64_t *state)
{
    *state += 0x9E3779B97F4A7C15u;
    uint64_t z = *state;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

struct sim_rng sim_rng_stream(uint64_t seed, uint32_t purpose, uint32_t index)
{
    struct sim_rng rng = {{0}, 0, false};
    uint64_t name = (uint64_t)purpose << 32 | index;
    uint64_t state = seed;
    state = spread(&state) ^ spread(&name);
    for (int i = 0; i < 4; i++)
        rng.state[i] = spread(&state);
    return rng;
}

static uint64_t rotate(uint64_t x, int by)
{
    return x << by | x >> (64 - by);
}

uint64_t sim_rng_next(struct sim_rng *rng)
{
    uint64_t *s = rng->state;
    uint64_t result = rotate(s[1] * 5, 7) * 9;
    uint64_t t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate(s[3], 45);
    return result;
}

double sim_rng_uniform(struct sim_rng *rng)
{
    return (double)(sim_rng_next(rng) >> 11) * 0x1p-53;
}

double sim_rng_normal(struct sim_rng *rng)
{
    if (rng->has_spare) {
        rng->has_spare = false;
        return rng->spare;
    }
    double x, y, square;
    do {
        x = 2 * sim_rng_uniform(rng) - 1;
        y = 2 * sim_rng_uniform(rng) - 1;
        square = x * x + y * y;
    } while (square >= 1 || square == 0);
    double scale = sqrt(-2 * log(square) / square);
    rng->spare = y * scale;
    rng->has_spare = true;
    return x * scale;
}
