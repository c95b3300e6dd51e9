#include "sim_rng.h"

#include <math.h>
#include <pthread.h>

enum { LAYERS = 256 };

#define TAIL_FROM 3.6541528853610088 /* where the lowest layer's rectangle ends, for 256 layers ... */
#define LAYER_AREA 4.92867323399e-3  /* ... of this area each, under exp(-x^2/2) */

static double edge[LAYERS + 1], height[LAYERS + 1]; /* right edges of the layers, outside in; exp(-x^2/2) there */

static void sim_rng_build_ziggurat(void)
{
    edge[0] = LAYER_AREA / exp(-0.5 * TAIL_FROM * TAIL_FROM);
    edge[1] = TAIL_FROM;
    for (int i = 2; i < LAYERS; i++)
        edge[i] = sqrt(-2 * log(LAYER_AREA / edge[i - 1] + exp(-0.5 * edge[i - 1] * edge[i - 1])));
    edge[LAYERS] = 0;
    for (int i = 0; i <= LAYERS; i++)
        height[i] = exp(-0.5 * edge[i] * edge[i]);
}

uint64_t sim_rng_mix(uint64_t *state)
{
    *state += 0x9E3779B97F4A7C15u;
    uint64_t z = *state;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

uint64_t sim_rng_mmix(uint64_t *state)
{
    return *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
}

struct sim_rng sim_rng_stream(uint64_t seed, uint32_t purpose, uint32_t index)
{
    struct sim_rng rng;
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, sim_rng_build_ziggurat);
    uint64_t name = (uint64_t)purpose << 32 | index;
    uint64_t state = seed;
    state = sim_rng_mix(&state) ^ sim_rng_mix(&name);
    /* The authors of xoshiro advise to seed by splitmix64. */
    for (int i = 0; i < 4; i++)
        rng.state[i] = sim_rng_mix(&state);
    return rng;
}

static uint64_t sim_rng_rotate(uint64_t x, int by)
{
    return x << by | x >> (64 - by);
}

uint64_t sim_rng_next(struct sim_rng *rng)
{
    uint64_t *s = rng->state;
    uint64_t result = sim_rng_rotate(s[1] * 5, 7) * 9;
    uint64_t t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = sim_rng_rotate(s[3], 45);
    return result;
}

double sim_rng_uniform(struct sim_rng *rng)
{
    return (double)(sim_rng_next(rng) >> 11) * 0x1p-53;
}

/* Beyond TAIL_FROM, by Marsaglia's method. */
static double sim_rng_tail(struct sim_rng *rng)
{
    double beyond, along;
    do {
        beyond = -log(1 - sim_rng_uniform(rng)) / TAIL_FROM;
        along = -log(1 - sim_rng_uniform(rng));
    } while (2 * along < beyond * beyond);
    return TAIL_FROM + beyond;
}

double sim_rng_normal(struct sim_rng *rng)
{
    for (;;) {
        uint64_t bits = sim_rng_next(rng);
        int layer = (int)(bits & (LAYERS - 1));
        double x = ((double)(bits >> 11) * 0x1p-52 - 1) * edge[layer];
        if (fabs(x) < edge[layer + 1])
            return x;
        if (layer == 0)
            return copysign(sim_rng_tail(rng), x);
        if (height[layer] + sim_rng_uniform(rng) * (height[layer + 1] - height[layer]) < exp(-0.5 * x * x))
            return x;
    }
}
