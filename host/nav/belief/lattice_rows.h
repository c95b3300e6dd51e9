/* The inner loops of a pass over the lattice, for one row of cells. Results are the same bits whatever the machine's
 * vectors: sums run in NAV_LANES fixed lanes, and no step is fused. */
#ifndef NAV_LATTICE_ROWS_H
#define NAV_LATTICE_ROWS_H

#include <stdint.h>

/* Loops run over whole lanes: they may read and write that many floats beyond a row's end. */
enum { NAV_LANES = 8 };

/* Sums over rows, by lane: mass and its products with x, y, xx, xy, yy; and the largest cell. */
struct nav_row_sums {
    float moment[6][NAV_LANES];
    float peak[NAV_LANES];
};

/* (centre at + side (above + below) + extra) like, over cells begin .. end - 1. */
struct nav_row_weigh {
    const float *at, *above, *below;
    const float *like;
    const float *coordinate; /* of cells in x */
    float y;                 /* of the row */
    float centre, side, extra;
    int begin, end;
    float *out;
    float least; /* of `thin`, see there */
};

struct nav_rows {
    /* out[i] = (1 - 2 side) in[i] + side (in[i - 1] + in[i + 1]) for begin <= i < end. */
    void (*blur)(const float *in, float side, int begin, int end, float *out);
    /* out[i] = (1 - 2 side) own[i] + the eight cells of from[0..3] at i and i - 1, weighted by w[2 k] and w[2 k + 1]. /
     */
    void (*mix)(const float *own, float side, const float *const from[4], const float w[8], int begin, int end,
                float *out);
    /* Writes a row and adds to its sums. `like` is 0 in NAV_LANES places from `end`; so many cells there become 0. */
    void (*weigh)(const struct nav_row_weigh *, struct nav_row_sums *);
    /* Writes centre at + side (above + below), 0 where that is at most `least`. */
    void (*thin)(const struct nav_row_weigh *);
};

/* The fastest this machine can run. */
const struct nav_rows *nav_rows_best(void);

/* Those that run anywhere. */
const struct nav_rows *nav_rows_plain(void);

#endif
