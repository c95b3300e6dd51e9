#include "texture_bands.h"

#include <math.h>
#include <stdlib.h>

#include "texture_fft.h"

enum { BANDS_MAX = 40, BANDS_PER_OCTAVE = 3 };

struct nav_texture_bands {
    int length, bands;
    int edge[BANDS_MAX + 1]; /* first bin of the transform in each band, and one past the last */
    double *taper;           /* [length] Hann */
    double *tapered;         /* [length] */
    double *power;           /* [size / 2 + 1] */
    double taper_power;
    struct nav_fft *fft;
};

static int power_of_two(int at_least)
{
    int size = 4;
    while (size < at_least)
        size *= 2;
    return size;
}

/* Bins 1 to size/2, in bands whose edges are a third of an octave apart but never less than one bin. */
static void make_edges(struct nav_texture_bands *b, int size)
{
    int last = 0;
    for (int step = 0; b->bands < BANDS_MAX; step++) {
        int bin = (int)lround(pow(2.0, (double)step / BANDS_PER_OCTAVE));
        if (bin >= size / 2)
            break;
        if (bin > last)
            b->edge[b->bands++] = bin;
        last = bin;
    }
    b->edge[b->bands] = size / 2 + 1;
}

static void make_taper(struct nav_texture_bands *b)
{
    for (int i = 0; i < b->length; i++) {
        b->taper[i] = 0.5 - 0.5 * cos(2.0 * acos(-1.0) * (i + 1) / (b->length + 1));
        b->taper_power += b->taper[i] * b->taper[i];
    }
}

struct nav_texture_bands *nav_texture_bands_new(int length)
{
    struct nav_texture_bands *b = calloc(1, sizeof *b);
    if (!b)
        return NULL;
    int size = power_of_two(length);
    b->length = length;
    b->taper = calloc((size_t)length, sizeof *b->taper);
    b->tapered = calloc((size_t)length, sizeof *b->tapered);
    b->power = calloc((size_t)size / 2 + 1, sizeof *b->power);
    b->fft = nav_fft_new(size);
    if (!b->taper || !b->tapered || !b->power || !b->fft) {
        nav_texture_bands_free(b);
        return NULL;
    }
    make_edges(b, size);
    make_taper(b);
    return b;
}

void nav_texture_bands_free(struct nav_texture_bands *b)
{
    if (!b)
        return;
    free(b->taper);
    free(b->tapered);
    free(b->power);
    nav_fft_free(b->fft);
    free(b);
}

int nav_texture_bands_count(const struct nav_texture_bands *b)
{
    return b->bands + 2;
}

static double step_power(const double *x, int n)
{
    double sum = 0.0;
    for (int i = 1; i < n; i++)
        sum += (x[i] - x[i - 1]) * (x[i] - x[i - 1]);
    return sum / (n - 1);
}

double *nav_texture_bands_work(struct nav_texture_bands *b, const double *x, double squares, double floor, double *out)
{
    for (int i = 0; i < b->length; i++)
        b->tapered[i] = x[i] * b->taper[i];
    nav_fft_power(b->fft, b->tapered, b->length, b->power);
    for (int band = 0; band < b->bands; band++) {
        double sum = 0.0;
        for (int k = b->edge[band]; k < b->edge[band + 1]; k++)
            sum += b->power[k];
        *out++ = log(sum / (b->taper_power * (b->edge[band + 1] - b->edge[band])) + floor);
    }
    *out++ = log(squares / b->length + floor);
    *out++ = log(step_power(x, b->length) + floor);
    return out;
}

double nav_texture_centre(const double *from, size_t stride, int n, double *to, double *squares)
{
    double sum = 0.0, left = 0.0;
    for (int i = 0; i < n; i++)
        sum += to[i] = from[(size_t)i * stride];
    for (int i = 0; i < n; i++) {
        to[i] -= sum / n;
        left += to[i] * to[i];
    }
    *squares = left;
    return sum / n;
}
