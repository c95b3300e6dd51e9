/* Mapping by touch: where the robot is and what its world is like, from rows alone. The first pose is the origin.
 *
 * Twelve hypotheses differ in how far they trust the odometry; each is a Gaussian over pose and map, weighed by the
 * likelihood of all rows. A lattice of tiles, where the evidence is for one, is tried on all rows so far before it is
 * believed. A mapper makes one map: of a robot that is carried off it says so, and takes no more. */
#ifndef NAV_MAPPER_H
#define NAV_MAPPER_H

#include "replay.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct nav_mapper;

struct nav_mapper_options {
    bool lattice; /* whether to look for a lattice of tiles */
};

/* The options' defaults. */
struct nav_mapper_options nav_mapper_default(void);

/* Of the problem's arena only `classes` is read. Copies nothing: the problem and its arrays must outlive it. NULL: no
 * memory. */
struct nav_mapper *nav_mapper_new(const struct nav_problem *, const struct nav_mapper_options *);
void nav_mapper_free(struct nav_mapper *);

/* Takes one row and says where the robot is at its end, in the frame of the first pose. Any row is allowed, as in
 * nav_filter_step. Does not allocate. */
void nav_mapper_step(struct nav_mapper *, const struct nav_row *, struct nav_estimate *);

/* Steps through rows, as nav_replay does. */
void nav_mapper_replay(struct nav_mapper *, const struct nav_rows *, long first, long count, struct nav_estimate *out,
                       double *step_us);

/* A stretch of a face that was felt: from (x0, y0) to (x1, y1), its free side to the right. */
struct nav_mapper_face {
    double x0, y0, x1, y1;
    double normal;       /* rad, of the outward normal */
    double normal_sigma; /* rad */
    double offset_sigma; /* m, along the normal */
    double hits;         /* contacts of the whole face */
    int face;            /* number of the face; several stretches may be of one */
    int right;           /* 1: held to be at right angles with the others */
};

/* The map's faces: the first `room` stretches go to `out`. Returns how many there are. */
long nav_mapper_faces(const struct nav_mapper *, struct nav_mapper_face *out, long room);

/* Where two faces meet at a wide angle. */
struct nav_mapper_corner {
    double x, y, xx, xy, yy; /* m; covariance, m^2 */
    int face[2];             /* their numbers */
};

/* The map's corners: the first `room` go to `out`. Returns how many there are. */
long nav_mapper_corners(const struct nav_mapper *, struct nav_mapper_corner *out, long room);

/* Square cells of `cell` m along the first pose's axes, the lower left corner of them all at (x, y). */
struct nav_mapper_grid {
    double x, y, cell;
    int columns, rows;
};

/* The smallest grid that holds all cells of which something is known; they reach 6.4 m from the first pose. */
struct nav_mapper_grid nav_mapper_grid(const struct nav_mapper *);

/* Probability that something solid is in each cell of that grid, out[rows][columns], the lowest y first; 0.5: nothing
 * is known. */
void nav_mapper_occupancy(const struct nav_mapper *, float *out);

/* Tile (0, 0) has its lower left corner at (x, y); tiles follow along `turn` and across it. pitch 0: no lattice. */
struct nav_mapper_lattice {
    double x, y, turn, pitch;
    double sigma_m, sigma_turn, sigma_pitch;
    double axes; /* direction of the faces' right angles, rad; NAN: not known */
};
struct nav_mapper_lattice nav_mapper_lattice(const struct nav_mapper *);

/* Probability of a tile's likeliest texture, and which it is; 0: nothing was read there. */
double nav_mapper_tile(const struct nav_mapper *, int column, int row, int *texture);

/* The robot was carried off before row `first`, counted from 0, which was noticed at row `noticed`; -1: it was not.
 * Then the map is the one of before that row, and takes no more rows: begin another mapper at `first`. */
struct nav_mapper_lost {
    long first, noticed;
};
struct nav_mapper_lost nav_mapper_lost(const struct nav_mapper *);

uint64_t nav_mapper_bad_cells(const struct nav_mapper *);
uint64_t nav_mapper_bad_rows(const struct nav_mapper *); /* repeated, late or reordered */
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
