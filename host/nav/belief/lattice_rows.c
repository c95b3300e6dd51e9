#include "lattice_rows.h"

#include <string.h>

typedef float lanes __attribute__((vector_size(NAV_LANES * sizeof(float))));
typedef int masks __attribute__((vector_size(NAV_LANES * sizeof(int))));

#define EVERYWHERE static inline __attribute__((always_inline))

EVERYWHERE void blur_row(const float *in, float side, int begin, int end, float *out)
{
    float centre = 1.0f - 2.0f * side;
    for (int i = begin; i < end; i += NAV_LANES) {
        lanes at, before, after;
        memcpy(&at, in + i, sizeof at);
        memcpy(&before, in + i - 1, sizeof at);
        memcpy(&after, in + i + 1, sizeof at);
        at = centre * at + side * (before + after);
        memcpy(out + i, &at, sizeof at);
    }
}

EVERYWHERE void mix_row(const float *own, float side, const float *const from[4], const float w[8], int begin, int end,
                        float *out)
{
    float centre = 1.0f - 2.0f * side;
    for (int i = begin; i < end; i += NAV_LANES) {
        lanes sum, a, b;
        memcpy(&sum, own + i, sizeof sum);
        sum *= centre;
        for (int k = 0; k < 4; k++) {
            memcpy(&a, from[k] + i, sizeof a);
            memcpy(&b, from[k] + i - 1, sizeof b);
            sum += w[2 * k] * a + w[2 * k + 1] * b;
        }
        memcpy(out + i, &sum, sizeof sum);
    }
}

struct wide_sums {
    lanes mass, x, xx, peak;
};

EVERYWHERE void weigh_lanes(const struct nav_row_weigh *w, int i, float *out, struct wide_sums *s)
{
    lanes v, above, below, like, x, part;
    memcpy(&v, w->at + i, sizeof v);
    memcpy(&above, w->above + i, sizeof v);
    memcpy(&below, w->below + i, sizeof v);
    memcpy(&like, w->like + i, sizeof v);
    memcpy(&x, w->coordinate + i, sizeof v);
    v = (w->centre * v + w->side * (above + below) + w->extra) * like;
    memcpy(out, &v, sizeof v);
    s->mass += v;
    part = v * x;
    s->x += part;
    s->xx += part * x;
    masks larger = v > s->peak;
    s->peak = (lanes)(((masks)v & larger) | ((masks)s->peak & ~larger));
}

EVERYWHERE void add_lanes(float sum[NAV_LANES], const lanes *v, float weight)
{
    lanes s;
    memcpy(&s, sum, sizeof s);
    s += *v * weight;
    memcpy(sum, &s, sizeof s);
}

EVERYWHERE void weigh_row(const struct nav_row_weigh *args, struct nav_row_sums *sums)
{
    struct nav_row_weigh w = *args;
    struct wide_sums s = {{0.0f}, {0.0f}, {0.0f}, {0.0f}};
    memcpy(&s.peak, sums->peak, sizeof s.peak);
    /* Likelihoods beyond the end are 0, and cells there are empty or of a row to be written later. */
    for (int i = w.begin; i < w.end; i += NAV_LANES)
        weigh_lanes(&w, i, w.out + i, &s);
    add_lanes(sums->moment[0], &s.mass, 1.0f);
    add_lanes(sums->moment[1], &s.x, 1.0f);
    add_lanes(sums->moment[2], &s.mass, w.y);
    add_lanes(sums->moment[3], &s.xx, 1.0f);
    add_lanes(sums->moment[4], &s.x, w.y);
    add_lanes(sums->moment[5], &s.mass, w.y * w.y);
    memcpy(sums->peak, &s.peak, sizeof s.peak);
}

EVERYWHERE void thin_row(const struct nav_row_weigh *args)
{
    struct nav_row_weigh w = *args;
    for (int i = w.begin; i < w.end; i += NAV_LANES) {
        lanes v, above, below;
        memcpy(&v, w.at + i, sizeof v);
        memcpy(&above, w.above + i, sizeof v);
        memcpy(&below, w.below + i, sizeof v);
        v = w.centre * v + w.side * (above + below);
        v = (lanes)((masks)v & (v > w.least));
        memcpy(w.out + i, &v, sizeof v);
    }
}

/* One set of the four functions, compiled for a target. */
#define ROWS(name, target)                                                                                             \
    target static void name##_blur(const float *in, float side, int begin, int end, float *out)                        \
    {                                                                                                                  \
        blur_row(in, side, begin, end, out);                                                                           \
    }                                                                                                                  \
    target static void name##_mix(const float *own, float side, const float *const from[4], const float w[8],          \
                                  int begin, int end, float *out)                                                      \
    {                                                                                                                  \
        mix_row(own, side, from, w, begin, end, out);                                                                  \
    }                                                                                                                  \
    target static void name##_weigh(const struct nav_row_weigh *w, struct nav_row_sums *sums)                          \
    {                                                                                                                  \
        weigh_row(w, sums);                                                                                            \
    }                                                                                                                  \
    target static void name##_thin(const struct nav_row_weigh *w)                                                      \
    {                                                                                                                  \
        thin_row(w);                                                                                                   \
    }                                                                                                                  \
    static const struct nav_rows name = {name##_blur, name##_mix, name##_weigh, name##_thin}

#define ANYWHERE
ROWS(plain, ANYWHERE);

const struct nav_rows *nav_rows_plain(void)
{
    return &plain;
}

#if defined(__x86_64__)
#define WITH_AVX2 __attribute__((target("avx2")))
ROWS(avx2, WITH_AVX2);

const struct nav_rows *nav_rows_best(void)
{
    return __builtin_cpu_supports("avx2") ? &avx2 : &plain;
}
#else
const struct nav_rows *nav_rows_best(void)
{
    return &plain;
}
#endif
