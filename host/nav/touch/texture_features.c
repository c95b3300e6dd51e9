#include "texture_features.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "texture_bands.h"
#include "texture_shape.h"
#include "texture_shorter.h"

#define CORRELATION_MOST 0.99 /* beyond it Fisher's z says more about quantisation than about the floor */

struct nav_texture_features {
    int channels, length, levels;
    double *floor;   /* [channels] */
    double *centred; /* [channels][length] */
    double *squares; /* [channels] sum of squares */
    struct nav_texture_bands *whole;
    struct nav_texture_shorter *shorter; /* NULL: the whole alone */
    struct nav_texture_shape *shape;     /* NULL: without */
};

static bool allocate(struct nav_texture_features *f, int shorter, const double *shape)
{
    size_t channels = (size_t)f->channels, length = (size_t)f->length;
    f->floor = calloc(channels, sizeof *f->floor);
    f->centred = calloc(channels * length, sizeof *f->centred);
    f->squares = calloc(channels, sizeof *f->squares);
    f->whole = nav_texture_bands_new(f->length);
    f->shorter = shorter > 0 ? nav_texture_shorter_new(f->length, shorter) : NULL;
    f->shape = shape ? nav_texture_shape_new(f->channels, f->length, shape) : NULL;
    return f->floor && f->centred && f->squares && f->whole && (f->shorter || shorter == 0) && (f->shape || !shape);
}

static bool sizes_ok(int channels, int length, int shorter, const double *floor)
{
    if (channels < 1 || channels > NAV_TEXTURE_CHANNELS_MAX)
        return false;
    if (shorter != 0 && (shorter < 2 || shorter > length / NAV_TEXTURE_LENGTH_MIN))
        return false;
    for (int c = 0; c < channels; c++) {
        if (!isfinite(floor[c]) || floor[c] < 0.0)
            return false;
    }
    return length >= NAV_TEXTURE_LENGTH_MIN && length <= NAV_TEXTURE_LENGTH_MAX;
}

struct nav_texture_features *nav_texture_features_new(int channels, int length, int levels, int shorter,
                                                      const double *floor, const double *shape)
{
    if (!sizes_ok(channels, length, shorter, floor))
        return NULL;
    struct nav_texture_features *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    *f = (struct nav_texture_features){.channels = channels, .length = length, .levels = levels != 0};
    if (!allocate(f, shorter, shape)) {
        nav_texture_features_free(f);
        return NULL;
    }
    for (int c = 0; c < channels; c++)
        f->floor[c] = floor[c] + NAV_TEXTURE_TINY;
    return f;
}

void nav_texture_features_free(struct nav_texture_features *f)
{
    if (!f)
        return;
    free(f->floor);
    free(f->centred);
    free(f->squares);
    nav_texture_bands_free(f->whole);
    nav_texture_shorter_free(f->shorter);
    nav_texture_shape_free(f->shape);
    free(f);
}

int nav_texture_features_count(const struct nav_texture_features *f)
{
    int shorter = f->shorter ? nav_texture_shorter_count(f->shorter) : 0;
    return f->channels * (nav_texture_bands_count(f->whole) + f->levels + shorter) +
           f->channels * (f->channels - 1) / 2 + (f->shape ? nav_texture_shape_count(f->length) : 0);
}

static double correlation(const struct nav_texture_features *f, int a, int b)
{
    const double *x = f->centred + (size_t)a * (size_t)f->length, *y = f->centred + (size_t)b * (size_t)f->length;
    double sum = 0.0;
    for (int i = 0; i < f->length; i++)
        sum += x[i] * y[i];
    double least = NAV_TEXTURE_TINY * f->length;
    double r = sum / sqrt((f->squares[a] + least) * (f->squares[b] + least));
    return atanh(fmin(fmax(r, -CORRELATION_MOST), CORRELATION_MOST));
}

void nav_texture_features_work(struct nav_texture_features *f, const double *window, double *out)
{
    for (int c = 0; c < f->channels; c++) {
        double *x = f->centred + (size_t)c * (size_t)f->length;
        double mean = nav_texture_centre(window + c, (size_t)f->channels, f->length, x, &f->squares[c]);
        out = nav_texture_bands_work(f->whole, x, f->squares[c], f->floor[c], out);
        if (f->levels)
            *out++ = mean;
        if (f->shorter)
            out = nav_texture_shorter_work(f->shorter, x, f->floor[c], out);
    }
    for (int a = 0; a < f->channels; a++) {
        for (int b = 0; b < a; b++)
            *out++ = correlation(f, a, b);
    }
    if (f->shape)
        nav_texture_shape_work(f->shape, f->centred, out);
}
