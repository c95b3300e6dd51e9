#include "texture_features.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "texture_fft.h"

enum { BANDS_MAX = 40, BANDS_PER_OCTAVE = 3 };
#define TINY 1e-12            /* counts squared: far below any sensor's step, keeps a constant channel's logs finite */
#define CORRELATION_MOST 0.99 /* beyond it Fisher's z says more about quantisation than about the floor */

struct nav_texture_features {
    int channels, length, levels, bands;
    int edge[BANDS_MAX + 1]; /* first bin of the transform in each band, and one past the last */
    double *floor;           /* [channels] */
    double *taper;           /* [length] Hann */
    double *centred;         /* [channels][length] */
    double *tapered;         /* [length] */
    double *power;           /* [size / 2 + 1] */
    double *spread;          /* [channels] sum of squares */
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
static void make_bands(struct nav_texture_features *f, int size)
{
    int last = 0;
    for (int step = 0; f->bands < BANDS_MAX; step++) {
        int bin = (int)lround(pow(2.0, (double)step / BANDS_PER_OCTAVE));
        if (bin >= size / 2)
            break;
        if (bin > last)
            f->edge[f->bands++] = bin;
        last = bin;
    }
    f->edge[f->bands] = size / 2 + 1;
}

static void make_taper(struct nav_texture_features *f)
{
    for (int i = 0; i < f->length; i++) {
        f->taper[i] = 0.5 - 0.5 * cos(2.0 * acos(-1.0) * (i + 1) / (f->length + 1));
        f->taper_power += f->taper[i] * f->taper[i];
    }
}

static bool allocate(struct nav_texture_features *f, int size)
{
    size_t channels = (size_t)f->channels, length = (size_t)f->length;
    f->floor = calloc(channels, sizeof *f->floor);
    f->taper = calloc(length, sizeof *f->taper);
    f->centred = calloc(channels * length, sizeof *f->centred);
    f->tapered = calloc(length, sizeof *f->tapered);
    f->power = calloc((size_t)size / 2 + 1, sizeof *f->power);
    f->spread = calloc(channels, sizeof *f->spread);
    f->fft = nav_fft_new(size);
    return f->floor && f->taper && f->centred && f->tapered && f->power && f->spread && f->fft;
}

static bool sizes_ok(int channels, int length, const double *floor)
{
    if (channels < 1 || channels > NAV_TEXTURE_CHANNELS_MAX)
        return false;
    for (int c = 0; c < channels; c++) {
        if (!isfinite(floor[c]) || floor[c] < 0.0)
            return false;
    }
    return length >= NAV_TEXTURE_LENGTH_MIN && length <= NAV_TEXTURE_LENGTH_MAX;
}

struct nav_texture_features *nav_texture_features_new(int channels, int length, int levels, const double *floor)
{
    if (!sizes_ok(channels, length, floor))
        return NULL;
    struct nav_texture_features *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    *f = (struct nav_texture_features){.channels = channels, .length = length, .levels = levels != 0};
    int size = power_of_two(length);
    if (!allocate(f, size)) {
        nav_texture_features_free(f);
        return NULL;
    }
    for (int c = 0; c < channels; c++)
        f->floor[c] = floor[c] + TINY;
    make_bands(f, size);
    make_taper(f);
    return f;
}

void nav_texture_features_free(struct nav_texture_features *f)
{
    if (!f)
        return;
    free(f->floor);
    free(f->taper);
    free(f->centred);
    free(f->tapered);
    free(f->power);
    free(f->spread);
    nav_fft_free(f->fft);
    free(f);
}

int nav_texture_features_count(const struct nav_texture_features *f)
{
    return f->channels * (f->bands + 2 + f->levels) + f->channels * (f->channels - 1) / 2;
}

/* Copies a channel less its mean, which is returned. */
static double centre(struct nav_texture_features *f, const double *window, int channel)
{
    double *to = f->centred + (size_t)channel * (size_t)f->length, sum = 0.0, squares = 0.0;
    for (int i = 0; i < f->length; i++)
        sum += to[i] = window[(size_t)i * (size_t)f->channels + (size_t)channel];
    for (int i = 0; i < f->length; i++) {
        to[i] -= sum / f->length;
        squares += to[i] * to[i];
    }
    f->spread[channel] = squares;
    return sum / f->length;
}

static double step_power(const double *x, int n)
{
    double sum = 0.0;
    for (int i = 1; i < n; i++)
        sum += (x[i] - x[i - 1]) * (x[i] - x[i - 1]);
    return sum / (n - 1);
}

static double *spectrum(struct nav_texture_features *f, int channel, double *out)
{
    const double *x = f->centred + (size_t)channel * (size_t)f->length;
    for (int i = 0; i < f->length; i++)
        f->tapered[i] = x[i] * f->taper[i];
    nav_fft_power(f->fft, f->tapered, f->length, f->power);
    for (int b = 0; b < f->bands; b++) {
        double sum = 0.0;
        for (int k = f->edge[b]; k < f->edge[b + 1]; k++)
            sum += f->power[k];
        *out++ = log(sum / (f->taper_power * (f->edge[b + 1] - f->edge[b])) + f->floor[channel]);
    }
    return out;
}

static double correlation(const struct nav_texture_features *f, int a, int b)
{
    const double *x = f->centred + (size_t)a * (size_t)f->length, *y = f->centred + (size_t)b * (size_t)f->length;
    double sum = 0.0;
    for (int i = 0; i < f->length; i++)
        sum += x[i] * y[i];
    double least = TINY * f->length;
    double r = sum / sqrt((f->spread[a] + least) * (f->spread[b] + least));
    return atanh(fmin(fmax(r, -CORRELATION_MOST), CORRELATION_MOST));
}

void nav_texture_features_work(struct nav_texture_features *f, const double *window, double *out)
{
    for (int c = 0; c < f->channels; c++) {
        double mean = centre(f, window, c);
        const double *x = f->centred + (size_t)c * (size_t)f->length;
        out = spectrum(f, c, out);
        *out++ = log(f->spread[c] / f->length + f->floor[c]);
        *out++ = log(step_power(x, f->length) + f->floor[c]);
        if (f->levels)
            *out++ = mean;
    }
    for (int a = 0; a < f->channels; a++) {
        for (int b = 0; b < a; b++)
            *out++ = correlation(f, a, b);
    }
}
