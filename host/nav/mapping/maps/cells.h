/* Occupancy about the first pose of a map, in square cells: log-odds that something solid is there. */
#ifndef NAV_CELLS_H
#define NAV_CELLS_H

#include "record.h"

#define NAV_CELLS_M 0.025      /* side of a cell */
enum { NAV_CELLS_SIDE = 512 }; /* cells each way, the origin at the lower left corner of the middle one */

struct nav_cells {
    float *odds;           /* [SIDE][SIDE], the lowest y first; 0: nothing is known */
    int from[2], until[2]; /* columns and rows that hold all that is known; until is beyond them */
};

/* 0, or -1 without memory; nav_cells_free either way. */
int nav_cells_init(struct nav_cells *);
void nav_cells_free(struct nav_cells *);
void nav_cells_clear(struct nav_cells *);
void nav_cells_copy(struct nav_cells *to, const struct nav_cells *from);

/* Log-odds at a point; 0 where nothing is known. */
double nav_cells_odds(const struct nav_cells *, double x, double y);

/* Takes what whiskers touched and passed in a row, and where the body stood. sigma: m, of the position. */
void nav_cells_take(struct nav_cells *, const struct nav_record *, const struct nav_record_row *, struct nav_pose pose,
                    double sigma);

/* Column or row of a coordinate, m. May lie outside. */
int nav_cells_at(double metres);

/* Widens what is known to hold a point, as far as there are cells. */
void nav_cells_hold(int from[2], int until[2], double x, double y);

#endif
