/* What a cell of the grid expects: the mix of signatures of its sub-poses, deduplicated.
 *
 * A cell's likelihood is the mean over its sub-poses. Wherever a shifted and turned cell may lie, to the nearest
 * sub-pose, its mix is one of a few thousand (walls look alike along their length, open floor everywhere), so that a
 * row costs the mixes that occur and one look-up per cell. Cells are numbered within small blocks, so that these
 * look-ups stay in the nearest cache. */
#ifndef NAV_MIXTURE_H
#define NAV_MIXTURE_H

#include <stddef.h>
#include <stdint.h>

#include "expected.h"

/* A signature (less 1) and its share of the sub-poses; those not free are left out. */
struct nav_part {
    uint32_t signature;
    float share;
};

/* Parts first .. end - 1, and their likelihood in a row, relative to the best signature. */
struct nav_mix {
    uint32_t first, end, row;
    float value;
};

struct nav_mixture {
    int nx, ny;      /* cells */
    ptrdiff_t pitch; /* nx + 2 */
    int sub, turns;  /* sub-poses per cell edge and per heading slice */
    int nh;          /* headings of sub-poses */
    int bands, band; /* a layer's ny + 2 rows fall into bands of `band` rows, each with its own list of mixes */
    uint16_t *cell;  /* [nh][sub][sub][ny + 2][nx + 2]: by first heading, phase in y and x, cell with a margin of one;
                        place of its mix in the band's list */
    uint32_t count;  /* mixes; number 0: nowhere free */
    struct nav_mix *mix; /* [count] */
    struct nav_part *part;
    uint32_t *listed;    /* [layers * bands + 1] where a band's list begins */
    uint32_t *list;      /* mixes */
    float *listed_value; /* likelihoods of the present row, beside `list` */
    uint32_t present;
    float *part_value; /* [signatures - 1] */
    int *begin, *end;  /* [ny] cells begin .. end - 1 of a row may be free, whatever the shift and turn */
};

/* A slice's place among the sub-poses: first heading, and first sub-pose in x and y of cell (0, 0), each -sub/2 ..
 * sub/2.
 */
struct nav_layer {
    int heading, x, y;
};

/* From a lattice of sub-poses with a margin of at least 3 * sub. NULL: no memory. */
struct nav_mixture *nav_mixture_new(const struct nav_expected *, int nx, int ny, int sub, int turns);
void nav_mixture_free(struct nav_mixture *);

/* Once per row, when the expected observations have been evaluated. */
void nav_mixture_begin(struct nav_mixture *, const struct nav_expected *);

/* Then for each layer that will be looked up. */
void nav_mixture_work_out(struct nav_mixture *, const struct nav_layer *);

/* Likelihoods of cells begin .. end - 1 of a layer's row, 0 <= row < ny. */
void nav_mixture_look_up(const struct nav_mixture *, const struct nav_layer *, int row, int begin, int end, float *out);

/* Mix of one cell of a layer. */
const struct nav_mix *nav_mixture_at(const struct nav_mixture *, const struct nav_layer *, int i, int j);

size_t nav_mixture_bytes(const struct nav_mixture *);

#endif
