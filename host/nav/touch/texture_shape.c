#include "texture_shape.h"

#include <stdlib.h>

#include "texture_own.h"

enum { TAPS = 9, KERNELS = 84, DILATIONS_MAX = 6 };

struct nav_texture_shape {
    int channels, length;
    const double *threshold; /* [dilation][KERNELS] */
    float *x;                /* [length] one channel */
    float *third;            /* [length] a third of the sum of all nine taps, at each place */
};

static int nav_texture_shape_dilations(int length)
{
    int count = 0;
    while (count < DILATIONS_MAX && TAPS << count <= length)
        count++;
    return count;
}

int nav_texture_shape_count(int length)
{
    return KERNELS * nav_texture_shape_dilations(length);
}

struct nav_texture_shape *nav_texture_shape_new(int channels, int length, const double *threshold)
{
    int count = nav_texture_shape_count(length);
    struct nav_texture_shape *s = count > 0 ? calloc(1, sizeof *s) : NULL;
    if (!s)
        return NULL;
    *s = (struct nav_texture_shape){.channels = channels, .length = length, .threshold = threshold};
    bool ok = nav_texture_own(&s->threshold, (size_t)count);
    s->x = calloc((size_t)length, sizeof *s->x);
    s->third = calloc((size_t)length, sizeof *s->third);
    if (!ok || !s->x || !s->third) {
        nav_texture_shape_free(s);
        return NULL;
    }
    return s;
}

void nav_texture_shape_free(struct nav_texture_shape *s)
{
    if (!s)
        return;
    free((void *)s->threshold);
    free(s->x);
    free(s->third);
    free(s);
}

static void nav_texture_shape_sum(struct nav_texture_shape *s, const double *x, int apart, int places)
{
    for (int i = 0; i < s->length; i++)
        s->x[i] = (float)x[i];
    for (int i = 0; i < places; i++) {
        float sum = 0.0F;
        for (int tap = 0; tap < TAPS; tap++)
            sum += s->x[i + tap * apart];
        s->third[i] = sum / 3.0F;
    }
}

/* The kernel's output is three times its three taps less all nine; both sides of the comparison are a third of that. */
static double nav_texture_shape_share(const struct nav_texture_shape *s, const int tap[3], int places, float threshold)
{
    const float *a = s->x + tap[0], *b = s->x + tap[1], *c = s->x + tap[2], *third = s->third;
    int above = 0;
    for (int i = 0; i < places; i++)
        above += a[i] + b[i] + c[i] - third[i] > threshold;
    return (double)above / places;
}

/* The kernels of one spread that are this channel's; kernels of the other channels are left. */
static void nav_texture_shape_channel(const struct nav_texture_shape *s, int apart, int first, const double *threshold,
                                      double *out)
{
    int kernel = 0, places = s->length - (TAPS - 1) * apart;
    for (int a = 0; a < TAPS; a++) {
        for (int b = a + 1; b < TAPS; b++) {
            for (int c = b + 1; c < TAPS; c++, kernel++) {
                const int tap[] = {a * apart, b * apart, c * apart};
                if (kernel % s->channels == first)
                    out[kernel] = nav_texture_shape_share(s, tap, places, (float)(threshold[kernel] / 3.0));
            }
        }
    }
}

void nav_texture_shape_work(struct nav_texture_shape *s, const double *x, double *out)
{
    for (int d = 0; d < nav_texture_shape_dilations(s->length); d++) {
        for (int c = 0; c < s->channels && c < KERNELS; c++) {
            nav_texture_shape_sum(s, x + (size_t)c * (size_t)s->length, 1 << d, s->length - ((TAPS - 1) << d));
            nav_texture_shape_channel(s, 1 << d, (c + d) % s->channels, s->threshold + d * KERNELS, out + d * KERNELS);
        }
    }
}
