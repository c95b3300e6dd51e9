#include "texture_features.h"

#include "texture_slab.h"

#define CORRELATION_MOST 0.99 /* beyond it Fisher's z says more about quantisation than about the floor */
#define TINY 1e-12            /* counts squared, far below any sensor's step: keeps a constant channel's logs finite */

enum { BANDS_MAX = 40, BANDS_PER_OCTAVE = 3, STRETCHES = 8, TAPS = 9, KERNELS = 84, DILATIONS_MAX = 6 };

/* Log powers of stretches of one length. The transform is radix 2: `size` real numbers, the stretch and zeros, are
 * taken as size/2 complex ones (even samples real, odd imaginary), transformed in place, and unravelled. */
struct spectrum {
    int length, size, bands;
    int edge[BANDS_MAX + 1]; /* first bin of the transform in each band, and one past the last */
    double *taper;           /* [length] Hann */
    double *turn;            /* [size/2][2] cos and -sin of 2 pi k / size */
    double *place;           /* [size/2][2] the numbers under way */
    int *reversed;           /* [size/2] */
    double taper_power;
};

struct nav_texture_features {
    int channels, length, shapes;
    const double *floor, *threshold; /* [channels]; [shapes], or NULL */
    double *straight;                /* [channels][length] about a line */
    double *squares;                 /* [channels] their sum of squares */
    double *part, *row;              /* [stretch.length] about a line; [STRETCHES][logs] */
    float *x, *third; /* [length] one channel; a third of the sum of all nine taps, at each place: single precision is
                         finer than any sensor */
    struct spectrum whole, stretch; /* the latter's length is 0 where windows are too short */
};

/* Bins 1 to size/2, in bands whose edges are a third of an octave apart but never less than one bin. */
static void features_edges(struct spectrum *b)
{
    b->bands = 0;
    for (int step = 0, last = 0; b->bands < BANDS_MAX; step++) {
        int bin = (int)lround(pow(2.0, (double)step / BANDS_PER_OCTAVE));
        if (bin >= b->size / 2)
            break;
        if (bin > last)
            b->edge[b->bands++] = bin;
        last = bin;
    }
    b->edge[b->bands] = b->size / 2 + 1;
}

static void features_tables(struct spectrum *b)
{
    double circle = 2.0 * acos(-1.0);
    for (int i = 0; i < b->length; i++) {
        b->taper[i] = 0.5 - 0.5 * cos(circle * (i + 1) / (b->length + 1));
        b->taper_power += b->taper[i] * b->taper[i];
    }
    for (int k = 0; k < b->size / 2; k++) {
        b->turn[2 * k] = cos(circle * k / b->size);
        b->turn[2 * k + 1] = -sin(circle * k / b->size);
        b->reversed[k] = b->reversed[k / 2] / 2 + (k % 2 ? b->size / 4 : 0);
    }
}

static void features_place_spectrum(struct spectrum *b, int length, struct nav_texture_slab *m)
{
    b->length = length;
    for (b->size = 4; b->size < length; b->size *= 2) {
    }
    features_edges(b);
    b->taper = nav_texture_slab_cut(m, (size_t)length);
    b->turn = nav_texture_slab_cut(m, (size_t)b->size);
    b->place = nav_texture_slab_cut(m, (size_t)b->size);
    b->reversed = (int *)nav_texture_slab_cut(m, (size_t)b->size / 2);
    if (m->at)
        features_tables(b);
}

static void features_place(void *of, struct nav_texture_slab *m)
{
    struct nav_texture_features *f = of;
    size_t channels = (size_t)f->channels, length = (size_t)f->length;
    nav_texture_slab_copy(m, &f->floor, channels);
    nav_texture_slab_copy(m, &f->threshold, (size_t)f->shapes);
    f->straight = nav_texture_slab_cut(m, channels * length);
    f->squares = nav_texture_slab_cut(m, channels);
    f->x = (float *)nav_texture_slab_cut(m, length);
    f->third = (float *)nav_texture_slab_cut(m, length);
    features_place_spectrum(&f->whole, f->length, m);
    int stretch = 2 * f->length / (STRETCHES + 1);
    if (stretch < NAV_TEXTURE_LENGTH_MIN)
        return;
    features_place_spectrum(&f->stretch, stretch, m);
    f->part = nav_texture_slab_cut(m, (size_t)stretch);
    f->row = nav_texture_slab_cut(m, STRETCHES * (size_t)(f->stretch.bands + 1));
}

static bool features_sizes_ok(int channels, int length, const double *floor)
{
    if (channels < 1 || channels > NAV_TEXTURE_CHANNELS_MAX)
        return false;
    for (int c = 0; c < channels; c++) {
        if (floor[c] < 0.0)
            return false;
    }
    return length >= NAV_TEXTURE_LENGTH_MIN && length <= NAV_TEXTURE_LENGTH_MAX;
}

struct nav_texture_features *nav_texture_features_new(int channels, int length, const double *floor,
                                                      const double *shape)
{
    if (!features_sizes_ok(channels, length, floor) || (shape && nav_texture_shape_count(length) == 0))
        return NULL;
    struct nav_texture_features like = {.channels = channels,
                                        .length = length,
                                        .shapes = shape ? nav_texture_shape_count(length) : 0,
                                        .floor = floor,
                                        .threshold = shape};
    return nav_texture_slab_new(&like, sizeof like, features_place);
}

void nav_texture_features_free(struct nav_texture_features *f)
{
    free(f);
}

static int features_dilations(int length)
{
    int count = 0;
    while (count < DILATIONS_MAX && TAPS << count <= length)
        count++;
    return count;
}

int nav_texture_shape_count(int length)
{
    return KERNELS * features_dilations(length);
}

int nav_texture_features_count(const struct nav_texture_features *f)
{
    int stretches = f->stretch.length ? 2 * (f->stretch.bands + 1) : 0;
    return f->channels * (f->whole.bands + 1 + stretches) + f->channels * (f->channels - 1) / 2 + f->shapes;
}

/* to[n] = every stride-th number of `from` less the straight line that fits them best. */
static void features_straighten(const double *from, size_t stride, int n, double *restrict to)
{
    double sum = 0.0, moment = 0.0, middle = 0.5 * (n - 1);
    for (int i = 0; i < n; i++) {
        to[i] = from[(size_t)i * stride];
        sum += to[i];
        moment += (i - middle) * to[i];
    }
    double slope = moment * 12.0 / ((double)n * ((double)n * n - 1.0)), level = sum / n;
    for (int i = 0; i < n; i++)
        to[i] -= level + slope * (i - middle);
}

static void features_butterfly(double *restrict a, double *restrict b, const double *restrict turn)
{
    double re = b[0] * turn[0] - b[1] * turn[1], im = b[0] * turn[1] + b[1] * turn[0];
    b[0] = a[0] - re;
    b[1] = a[1] - im;
    a[0] += re;
    a[1] += im;
}

/* The first two stages at once: their turns are by quarters of the circle, which need no products. */
static void features_quarters(double *place, int count)
{
    for (double *p = place; p < place + 2 * count; p += 8) {
        double a_re = p[0] + p[2], a_im = p[1] + p[3], b_re = p[0] - p[2], b_im = p[1] - p[3];
        double c_re = p[4] + p[6], c_im = p[5] + p[7], d_re = p[4] - p[6], d_im = p[5] - p[7];
        p[0] = a_re + c_re;
        p[1] = a_im + c_im;
        p[2] = b_re + d_im;
        p[3] = b_im - d_re;
        p[4] = a_re - c_re;
        p[5] = a_im - c_im;
        p[6] = b_re - d_im;
        p[7] = b_im + d_re;
    }
}

static void features_transform(const struct spectrum *b, const double *x)
{
    int count = b->size / 2, done = count >= 4 ? 4 : 1;
    memset(b->place, 0, (size_t)b->size * sizeof *b->place);
    for (int i = 0; i < b->length; i++)
        b->place[2 * b->reversed[i / 2] + i % 2] = x[i] * b->taper[i];
    if (done == 4)
        features_quarters(b->place, count);
    for (int width = done; width < count; width *= 2) {
        int stride = count / width; /* of the table, which has the whole circle's angles for `size` */
        for (int start = 0; start < count; start += 2 * width) {
            for (int k = 0; k < width; k++)
                features_butterfly(b->place + 2 * (start + k), b->place + 2 * (start + k + width),
                                   b->turn + 2 * k * stride);
        }
    }
}

/* |X[k]|^2: of the transforms E and O of even and odd samples, Z[k] = E[k] + j O[k] is known, and
 * X[k] = E[k] + exp(-2 pi j k / size) O[k]. */
static double features_power(const struct spectrum *b, int k)
{
    int half = b->size / 2, around = half - 1; /* what the mask keeps is the rest of a division by a power of two */
    const double *z = b->place + 2 * (k & around), *y = b->place + 2 * ((half - k) & around);
    double even_re = 0.5 * (z[0] + y[0]), even_im = 0.5 * (z[1] - y[1]);
    double odd_re = 0.5 * (z[1] + y[1]), odd_im = -0.5 * (z[0] - y[0]);
    double c = k == half ? -1.0 : b->turn[2 * k], s = k == half ? 0.0 : b->turn[2 * k + 1];
    double re = even_re + c * odd_re - s * odd_im, im = even_im + s * odd_re + c * odd_im;
    return re * re + im * im;
}

/* Log powers of a stretch about a line: by bands, and of the steps. */
static void features_logs(const struct spectrum *b, const double *x, double floor, double *out)
{
    double steps = 0.0;
    features_transform(b, x);
    for (int band = 0; band < b->bands; band++) {
        double sum = 0.0;
        for (int k = b->edge[band]; k < b->edge[band + 1]; k++)
            sum += features_power(b, k);
        *out++ = log(sum / (b->taper_power * (b->edge[band + 1] - b->edge[band])) + floor);
    }
    for (int i = 1; i < b->length; i++)
        steps += (x[i] - x[i - 1]) * (x[i] - x[i - 1]);
    *out = log(steps / (b->length - 1) + floor);
}

/* Statistics of a channel's stretches: the mean of each log, then its standard deviation. */
static double *features_stretches(const struct nav_texture_features *f, const double *x, double floor, double *out)
{
    int count = f->stretch.bands + 1, length = f->stretch.length;
    for (int i = 0; i < STRETCHES; i++) {
        features_straighten(x + (f->length - length) * i / (STRETCHES - 1), 1, length, f->part);
        features_logs(&f->stretch, f->part, floor, f->row + i * count);
    }
    for (int c = 0; c < count; c++) {
        double mean = 0.0, squares = 0.0;
        for (int i = 0; i < STRETCHES; i++)
            mean += f->row[i * count + c] / STRETCHES;
        for (int i = 0; i < STRETCHES; i++)
            squares += (f->row[i * count + c] - mean) * (f->row[i * count + c] - mean);
        out[c] = mean;
        out[count + c] = sqrt(squares / STRETCHES);
    }
    return out + 2 * count;
}

static double features_product(const double *x, const double *y, int n)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

/* Fisher's z of the correlation of two channels. */
static double features_correlation(const struct nav_texture_features *f, int a, int b)
{
    const double *x = f->straight + (size_t)a * (size_t)f->length, *y = f->straight + (size_t)b * (size_t)f->length;
    double least = TINY * f->length, spread = (f->squares[a] + least) * (f->squares[b] + least);
    double r = features_product(x, y, f->length) / sqrt(spread);
    return atanh(fmin(fmax(r, -CORRELATION_MOST), CORRELATION_MOST));
}

/* A kernel's output is three times its three taps less all nine; both sides of the comparison are a third of that. */
static double features_share(const struct nav_texture_features *f, const int tap[3], int places, float threshold)
{
    const float *a = f->x + tap[0], *b = f->x + tap[1], *c = f->x + tap[2], *third = f->third;
    int above = 0;
    for (int i = 0; i < places; i++)
        above += a[i] + b[i] + c[i] - third[i] > threshold;
    return (double)above / places;
}

/* The kernels of one spread that are this channel's: from `first` on, every so many as there are channels. */
static void features_kernels(const struct nav_texture_features *f, int apart, int first, const double *threshold,
                             double *out)
{
    int kernel = 0, places = f->length - (TAPS - 1) * apart;
    for (int i = 0; i < places; i++) {
        float sum = 0.0F;
        for (int tap = 0; tap < TAPS; tap++)
            sum += f->x[i + tap * apart];
        f->third[i] = sum / 3.0F;
    }
    for (int a = 0; a < TAPS; a++) {
        for (int b = a + 1; b < TAPS; b++) {
            for (int c = b + 1; c < TAPS; c++, kernel++) {
                const int tap[] = {a * apart, b * apart, c * apart};
                if (kernel % f->channels == first)
                    out[kernel] = features_share(f, tap, places, (float)(threshold[kernel] / 3.0));
            }
        }
    }
}

static void features_shapes(const struct nav_texture_features *f, double *out)
{
    for (int d = 0; d < f->shapes / KERNELS; d++) {
        for (int c = 0; c < f->channels && c < KERNELS; c++) {
            for (int i = 0; i < f->length; i++)
                f->x[i] = (float)f->straight[(size_t)c * (size_t)f->length + (size_t)i];
            features_kernels(f, 1 << d, (c + d) % f->channels, f->threshold + d * KERNELS, out + d * KERNELS);
        }
    }
}

void nav_texture_features_work(struct nav_texture_features *f, const double *window, double *out)
{
    for (int c = 0; c < f->channels; c++) {
        double *x = f->straight + (size_t)c * (size_t)f->length, floor = f->floor[c] + TINY;
        features_straighten(window + c, (size_t)f->channels, f->length, x);
        f->squares[c] = features_product(x, x, f->length);
        features_logs(&f->whole, x, floor, out);
        out += f->whole.bands + 1;
        if (f->stretch.length)
            out = features_stretches(f, x, floor, out);
    }
    for (int a = 0; a < f->channels; a++) {
        for (int b = 0; b < a; b++)
            *out++ = features_correlation(f, a, b);
    }
    features_shapes(f, out);
}
