#include "texture_fft.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMALLEST = 4, LARGEST = 65536 };

/* The real window is taken as size/2 complex numbers (even samples real, odd imaginary), transformed in place, and
 * unravelled: half the work of a complex transform of the whole. */
struct nav_fft {
    int size;
    double *turn;  /* [size/2][2] cos and -sin of 2 pi k / size */
    double *place; /* [size/2][2] the numbers under way */
    int *reversed; /* [size/2] */
};

static void make_tables(struct nav_fft *f)
{
    int half = f->size / 2;
    for (int k = 0; k < half; k++) {
        double angle = 2.0 * acos(-1.0) * k / f->size;
        f->turn[2 * k] = cos(angle);
        f->turn[2 * k + 1] = -sin(angle);
    }
    for (int k = 1; k < half; k++)
        f->reversed[k] = f->reversed[k / 2] / 2 + (k % 2 ? half / 2 : 0);
}

struct nav_fft *nav_fft_new(int size)
{
    if (size < SMALLEST || size > LARGEST || (size & (size - 1)) != 0)
        return NULL;
    struct nav_fft *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    f->size = size;
    f->turn = calloc((size_t)size, sizeof *f->turn);
    f->place = calloc((size_t)size, sizeof *f->place);
    f->reversed = calloc((size_t)size / 2, sizeof *f->reversed);
    if (!f->turn || !f->place || !f->reversed) {
        nav_fft_free(f);
        return NULL;
    }
    make_tables(f);
    return f;
}

void nav_fft_free(struct nav_fft *f)
{
    if (!f)
        return;
    free(f->turn);
    free(f->place);
    free(f->reversed);
    free(f);
}

static void scatter(struct nav_fft *f, const double *x, int n)
{
    memset(f->place, 0, (size_t)f->size * sizeof *f->place);
    for (int i = 0; i < n; i++)
        f->place[2 * f->reversed[i / 2] + i % 2] = x[i];
}

static void butterfly(double *restrict a, double *restrict b, const double *restrict turn)
{
    double re = b[0] * turn[0] - b[1] * turn[1], im = b[0] * turn[1] + b[1] * turn[0];
    b[0] = a[0] - re;
    b[1] = a[1] - im;
    a[0] += re;
    a[1] += im;
}

/* The first two stages at once: their turns are by quarters of the circle, which need no products. */
static void quarters(double *place, int count)
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

static void transform(struct nav_fft *f)
{
    int count = f->size / 2, done = count >= 4 ? 4 : 1;
    if (done == 4)
        quarters(f->place, count);
    for (int width = done; width < count; width *= 2) {
        int stride = count / width; /* of the table, which has the whole circle's angles for `size` */
        for (int start = 0; start < count; start += 2 * width) {
            for (int k = 0; k < width; k++)
                butterfly(f->place + 2 * (start + k), f->place + 2 * (start + k + width), f->turn + 2 * k * stride);
        }
    }
}

/* Z[k] = E[k] + j O[k], with E and O the transforms of even and odd samples: X[k] = E[k] + exp(-2 pi j k / size) O[k].
 */
static double unravelled(const struct nav_fft *f, int k)
{
    int half = f->size / 2,
        around = half - 1; /* a power of two less one: what the mask keeps is the rest of a division */
    const double *z = f->place + 2 * (k & around), *y = f->place + 2 * ((half - k) & around);
    double even_re = 0.5 * (z[0] + y[0]), even_im = 0.5 * (z[1] - y[1]);
    double odd_re = 0.5 * (z[1] + y[1]), odd_im = -0.5 * (z[0] - y[0]);
    double c = k == half ? -1.0 : f->turn[2 * k], s = k == half ? 0.0 : f->turn[2 * k + 1];
    double re = even_re + c * odd_re - s * odd_im, im = even_im + s * odd_re + c * odd_im;
    return re * re + im * im;
}

void nav_fft_power(struct nav_fft *f, const double *x, int n, double *power)
{
    scatter(f, x, n);
    transform(f);
    for (int k = 0; k <= f->size / 2; k++)
        power[k] = unravelled(f, k);
}
