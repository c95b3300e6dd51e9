/* Measurement models: log-likelihood of one whisker's reading by what the map leads one to expect.
 *
 * What can be expected of a whisker is one of a few codes: for a texture whisker the texture's index, for an object
 * whisker the contact's distance in steps, the last code meaning "nothing within reach". A model fills a table over
 * codes once per reading, and every pose, cell or hypothesis costs a look-up. One function shape, one file per model.
 */
#ifndef NAV_MEASUREMENT_H
#define NAV_MEASUREMENT_H

#include "settings.h"

struct nav_model;

/* Fills ratio[model->codes] with p(reading | code) / p(reading | whisker broken). Above 1 a reading speaks for a code,
 * and for a whisker that works. reading: model->values doubles, finite; for an object whisker in m, INFINITY for "no
 * contact". A broken whisker is taken to say any class, any distance, or for ever nothing. */
typedef void nav_measurement(const struct nav_model *, const double *reading, double *ratio);

struct nav_model {
    nav_measurement *fill;
    const struct nav_settings *settings;
    int values;      /* doubles per reading */
    int codes;       /* at most 256 */
    double length;   /* object whiskers: m */
    double step;     /* m per code; code k stands for a contact at (k + 1/2) steps */
    double sigma;    /* m, of a measured distance, the spread of a pose's cell included */
    double edge;     /* m, of the end of reach, likewise */
    double *noticed; /* object whiskers: [codes] share of contacts that are noticed, from nav_mm_radial_begin */
    double temper;   /* texture whiskers: exponent on a window's likelihood */
    double gap;      /* running median of log-likelihood between best class and second, 0: none seen */
    double accuracy; /* share of windows whose best class is right, as far as is known */
};

nav_measurement nav_mm_texture; /* eq. 1's log-likelihoods, tempered, with an outlier floor */
nav_measurement nav_mm_radial;  /* Gaussian distance, misses, ghosts, null contacts */

/* Fills model->noticed, which is the caller's, for an object whisker whose other numbers are set. */
void nav_mm_radial_begin(struct nav_model *);

/* Before a texture whisker's first window. */
void nav_mm_texture_begin(struct nav_model *);

/* Notes a window's spread and sets the temper for it. A fixed temper (setting above 0) stays as it is. */
void nav_mm_texture_watch(struct nav_model *, const double *reading);

#endif
