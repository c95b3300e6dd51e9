#include "radial.h"

#include <math.h>

/* Squared deflection magnitude; NaN or infinite when an axis is. */
static double radial_squared_deflection(const double *sample, int axes, const double *rest)
{
    double sum = 0.0;
    for (int a = 0; a < axes; a++)
        sum += (sample[a] - rest[a]) * (sample[a] - rest[a]);
    return sum;
}

double nav_radial_peak(const double *samples, size_t n, int axes, const double *rest)
{
    double best = -1.0;
    for (size_t i = 0; i < n; i++) {
        double square = radial_squared_deflection(samples + i * (size_t)axes, axes, rest);
        if (isfinite(square) && square > best)
            best = square;
    }
    return best < 0.0 ? (double)NAN : sqrt(best);
}

struct sums {
    long n;
    double f, r, ff, fr, rr; /* means first, then sums of squares about the means */
    double low, high;
};

static int radial_usable(double f, double r)
{
    return isfinite(f) && isfinite(r);
}

static struct sums radial_summarise(const double *f, const double *r, size_t n)
{
    struct sums s = {.low = INFINITY, .high = -INFINITY};
    for (size_t i = 0; i < n; i++) {
        if (!radial_usable(f[i], r[i]))
            continue;
        s.n++;
        s.f += f[i];
        s.r += r[i];
        s.low = fmin(s.low, r[i]);
        s.high = fmax(s.high, r[i]);
    }
    s.f /= (double)s.n;
    s.r /= (double)s.n;
    for (size_t i = 0; i < n; i++) {
        if (!radial_usable(f[i], r[i]))
            continue;
        s.ff += (f[i] - s.f) * (f[i] - s.f);
        s.fr += (f[i] - s.f) * (r[i] - s.r);
        s.rr += (r[i] - s.r) * (r[i] - s.r);
    }
    return s;
}

long nav_radial_fit(struct nav_radial *model, const double *peak_counts, const double *radius_mm, size_t n)
{
    struct sums s = radial_summarise(peak_counts, radius_mm, n);
    if (s.n < 3 || !(s.ff > 0.0))
        return -1;
    double a1 = s.fr / s.ff;
    double residual = fmax(0.0, s.rr - a1 * s.fr);
    *model = (struct nav_radial){.a1 = a1,
                                 .a0 = s.r - a1 * s.f,
                                 .sigma_mm = sqrt(residual / (double)(s.n - 2)),
                                 .low_mm = s.low,
                                 .high_mm = s.high};
    return s.n;
}

double nav_radial_predict(const struct nav_radial *model, double peak_counts)
{
    return model->a1 * peak_counts + model->a0;
}
