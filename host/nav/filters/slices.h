/* What histograms over x, y and heading have in common, slice by slice: whole-cell moves, mass near a pose, moments. A
 * slice holds the cells of one heading and has its own shift in x and y. */
#ifndef NAV_SLICES_H
#define NAV_SLICES_H

#include <stddef.h>

#include "lattice_rows.h"
#include "pose.h"

/* Mass of a slice and its sums times x, y, xx, xy, yy, relative to some place. */
enum { NAV_MOMENTS = 6 };

struct nav_slice {
    const float *mass; /* [ny][pitch] */
    int nx, ny, pitch;
    double cell, x, y; /* m: edge of a cell, centre of cell (0, 0) */
    double heading;    /* rad */
};

/* Mass near a pose, and its offsets from that times mass. */
struct nav_near {
    double mass, x, y, theta;
};

/* Adds to a shift and returns the whole cells it has gathered, at most `most` either way; beyond these the shift stays
 * within half a cell. */
int nav_slice_carry(double *shift, double by, double cell, int most);

/* Adds the cells whose centres are within NAV_NEAR_M and NAV_NEAR_RAD of a pose. */
void nav_slice_near(const struct nav_slice *, struct nav_pose, struct nav_near *);

/* Mean of what was added for that pose, which must not be nothing. */
struct nav_pose nav_near_mean(const struct nav_near *, struct nav_pose);

/* Coordinates of `count` cells from `first` on, `step` apart, as the rows' loops take them. */
void nav_slice_coordinates(double first, double step, int count, float *out);

/* A slice's moments from its rows' sums. */
void nav_slice_moments(const struct nav_row_sums *, double moments[NAV_MOMENTS]);

/* Adds one slice's moments about (x, y) to sums xx, xy, yy, xt, yt, tt, its heading being off by `turn`. */
void nav_slice_add(const double moments[NAV_MOMENTS], double x, double y, double turn, double sums[6]);

/* Covariance from these sums over all slices, `total` being their mass; the spread within a cell (m, rad) included;
 * row-major. */
void nav_slice_covariance(const double sums[6], double total, double cell, double cell_theta, double covariance[9]);

#endif
