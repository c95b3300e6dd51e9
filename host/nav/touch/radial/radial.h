/* Radial distance of a contact along a whisker: peak deflection and a line (CrunchBot paper, equations 2 and 3). */
#ifndef NAV_RADIAL_H
#define NAV_RADIAL_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
/* r = a1 f1 + a0 (equation 3). */
struct nav_radial {
    double a1;       /* mm per count, below 0: nearer contacts bend the whisker more */
    double a0;       /* mm */
    double sigma_mm; /* standard error of the regression, sqrt(SSE / (n - 2)) */
    double low_mm;   /* smallest and largest radius fitted: the range the line is known on */
    double high_mm;
};

/* Equation 2: largest deflection magnitude |sample - rest| of a contact, counts. samples [n][axes], rest [axes].
 * Samples with a non-finite axis are skipped; NaN when none is left. */
double nav_radial_peak(const double *samples, size_t n, int axes, const double *rest);

/* Least-squares line through n contacts; pairs with a non-finite member are skipped. Returns the number of contacts
 * used, or -1 when fewer than 3 are usable or all peaks are equal (the model is then untouched). */
long nav_radial_fit(struct nav_radial *, const double *peak_counts, const double *radius_mm, size_t n);

/* Predicted radius of one peak, mm. */
double nav_radial_predict(const struct nav_radial *, double peak_counts);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
