/* A window beside its halves, and beside those of the window before: a second view of the same samples, and where the
 * surface changed. */
#ifndef NAV_TEXTURE_HALVES_H
#define NAV_TEXTURE_HALVES_H

#include <stdbool.h>

#include "texture_span.h"

struct nav_texture_halves {
    int channels, classes;
    double growth, together;
    const double *border; /* [classifiers] as in struct nav_texture_rules; lent */
    double *half[3];      /* [classes] evidence of the window before's second half, of the first and the second half */
    double *before;       /* [classes] evidence of the window before */
    bool has_before;
    int half_classifier, before_classifier;
};

/* False without memory; free it in any case. `border` is lent. */
bool nav_texture_halves_make(struct nav_texture_halves *, const struct nav_texture_rules *, const double *border);
void nav_texture_halves_free(struct nav_texture_halves *);

/* Judges both halves of n samples alone; where one classifier judges both, their mean with the whole, which errs less
 * than either, replaces loglik[classes]. Returns that classifier, or -1. */
int nav_texture_halves_judge(struct nav_texture_halves *, struct nav_texture_span *, const double *from, int n,
                             double *loglik);

/* Whether there is a border between half and half, between window and window, or between the window before and the
 * later half, which hold nothing of the other surface if the border lies in the earlier half. When the halves differ,
 * what counts is the later one: it replaces loglik. The halves and the window become those before. */
bool nav_texture_halves_border(struct nav_texture_halves *, double *loglik, int classifier, int half_classifier);

#endif
