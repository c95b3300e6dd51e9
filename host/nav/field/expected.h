/* What the whiskers should meet at every pose of a lattice over the whole arena, computed once.
 *
 * Many poses share the same expected codes, their signature: the likelihood is worked out once per signature and row,
 * and a pose costs one look-up. The paper keeps likelihoods of the whole arena in a hash table for the same reason. */
#ifndef NAV_EXPECTED_H
#define NAV_EXPECTED_H

#include <stddef.h>
#include <stdint.h>

#include "factor.h"
#include "likelihood.h"

/* Lattice of nx x ny x nh poses; pose (i, j, k) is at (i + 1/2) step, (j + 1/2) step, (k + 1/2) step_theta. Around it
 * lie `margin` poses on each side in x and y, all blocked, so that a shifted reader needs no bounds checks. */
struct nav_expected {
    int nx, ny, nh, margin;
    double step, step_theta; /* m, rad */
    int whiskers;
    uint32_t *signature; /* [nh][ny + 2 margin][nx + 2 margin]; 0: not in free space */
    uint32_t signatures; /* how many there are, number 0 included */
    uint8_t *codes;      /* [signatures][whiskers + 1], the last always 0 */
    struct nav_factor factor;
    const double *value; /* [signatures - 1] likelihood of the present row, of signature n at n - 1 */
};

/* NULL: no memory, or a lattice of more than 2^28 poses. */
struct nav_expected *nav_expected_new(const struct nav_likelihood *, double step, int headings, int margin);
void nav_expected_free(struct nav_expected *);

/* Works out `value` for the row last read into the likelihood, relative to the product of each whisker's best code: at
 * most 1. Whiskers' ranges are cut so that no product underflows. */
void nav_expected_evaluate(struct nav_expected *, const struct nav_likelihood *);

/* The same for what one asks for only: prepares it from the whiskers' tables of log-likelihoods (table[w][code]), ...
 */
void nav_expected_prepare(struct nav_expected *, const float *const *table);

/* ... and works out signature n > 0. */
static inline double nav_expected_one(const struct nav_expected *e, uint32_t n)
{
    return nav_factor_one(&e->factor, n - 1);
}

/* First pose of lattice row j (-margin <= j < ny + margin) at heading k; index -margin .. nx + margin - 1 is valid. */
const uint32_t *nav_expected_row(const struct nav_expected *, int k, int j);

/* Frees the lattice and keeps the signatures: for those who have made tables of their own from it. */
void nav_expected_forget_poses(struct nav_expected *);

size_t nav_expected_bytes(const struct nav_expected *);

#endif
