/* What the whiskers should meet at every pose of a lattice over the whole arena, computed once, and the likelihood of
 * cells of it: the mean over a cell's sub-poses, so that a border that cuts a cell counts by its share.
 *
 * Many poses share the same expected codes, their signature: a likelihood is worked out once per signature and row,
 * when first asked for, and a pose costs one look-up. The paper keeps likelihoods of the whole arena in a hash table
 * for the same reason. */
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
    int sub, turns;          /* poses per cell edge and per heading of a cell */
    int whiskers;
    uint32_t *signature; /* [nh][ny + 2 margin][nx + 2 margin]; 0: not in free space */
    uint32_t signatures; /* how many there are, number 0 included */
    uint8_t *codes;      /* [signatures][whiskers + 1], the last always 0 */
    struct nav_factor factor;
    float *value;            /* [signatures] likelihood of the present row; negative: not yet worked out */
    uint32_t *known, knowns; /* those worked out */
    double unmapped;         /* factor of ground that is not mapped: the prior's while a belief is uniform, else 1 */
    double standing;         /* share of the lattice's poses that are free, those that are not mapped by their prior */
};

/* Cells of an edge and so many headings, each with sub * sub * turns poses. NULL: no memory, or a lattice of more than
 * 2^28 poses. */
struct nav_expected *nav_expected_new(const struct nav_likelihood *, double cell, int headings, int sub, int turns);
void nav_expected_free(struct nav_expected *);

/* Begins a row, from the whiskers' tables of log-likelihoods (table[w][code]); values are relative to the product of
 * each whisker's best code, at most 1. Whiskers' ranges are cut so that no product underflows. `blocked`: what poses
 * that are not free get. */
void nav_expected_begin(struct nav_expected *, const float *const *table, float blocked);

/* Works out all signatures, scaled so that the largest is 1: where none fits, single precision may hold none of them
 * else. */
void nav_expected_scale(struct nav_expected *);

/* Where the poses of a slice of cells lie in the lattice, to the nearest: first heading, and the first pose in x and y
 * of cell (0, 0). heading: of the slice's middle, rad; the shifts of its cells, m, within half a cell. */
struct nav_layer {
    int heading, x, y;
};
struct nav_layer nav_expected_layer(const struct nav_expected *, double heading, double shift_x, double shift_y);

/* Likelihoods of cells first .. first + NAV_CELLS_AHEAD - 1 of a row of a layer, the first in the arena. Those of cells
 * without mass mean nothing. */
enum { NAV_CELLS_AHEAD = 8 };
void nav_expected_mean(struct nav_expected *, const struct nav_layer *, int row, int first, const float *mass,
                       float *like);

/* What pose number n < sub * sub * turns of a cell expects: its codes; NULL where it is not free. */
const uint8_t *nav_expected_codes(const struct nav_expected *, const struct nav_layer *, int row, int column, int n);

size_t nav_expected_bytes(const struct nav_expected *);

#endif
