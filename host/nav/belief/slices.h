/* What histograms over x, y and heading have in common, slice by slice: whole-cell moves, mass near a pose, moments. A
 * slice holds the cells of one heading and has its own shift in x and y; all share one rotation. */
#ifndef NAV_SLICES_H
#define NAV_SLICES_H

#include <stddef.h>

#include "gaussian.h"
#include "lattice_rows.h"
#include "pose.h"

/* Mass of a slice and its sums times x, y, xx, xy, yy, relative to some place. */
enum { NAV_MOMENTS = 6 };

/* A histogram as its sums see it; it owns nothing. */
struct nav_slices {
    const float *mass; /* [nh][ny][pitch], in any unit; cells beyond nx are empty */
    int nx, ny, nh, pitch;
    double cell, cell_theta;         /* m, rad */
    double rotation;                 /* rad */
    const double *shift_x, *shift_y; /* [nh] m: cell i is centred at (i + 1/2) cell + shift */
    double (*moment)[NAV_MOMENTS];   /* [nh] relative to */
    double moment_x, moment_y;       /* this place, m; */
    double total;                    /* and the mass they add up to */
};

/* Heading of slice p, rad, not wrapped. */
static inline double nav_slice_heading(int p, double cell_theta, double rotation)
{
    return (p + 0.5) * cell_theta + rotation;
}

/* Centre of cell number `index` of `mass`. */
struct nav_pose nav_slices_centre(const struct nav_slices *, size_t index);

/* Mass within NAV_NEAR_M and NAV_NEAR_RAD of a pose, the centres of cells deciding, in the unit of `mass`; and its mean
 * pose, when not NULL and there is any. */
double nav_slices_near(const struct nav_slices *, struct nav_pose, struct nav_pose *mean);

/* Covariance of the whole belief about a pose, from the moments, which must hold mass; the spread within a cell
 * included; row-major, m and rad. */
void nav_slices_covariance(const struct nav_slices *, struct nav_pose about, double covariance[9]);

/* The belief as one Gaussian: the mean near its mode and the covariance about that. Returns the mass near the mean. */
double nav_slices_summarise(const struct nav_slices *, struct nav_pose mode, struct nav_gaussian *out);

/* Variance that a drive adds to positions because headings differ within a slice (uniform: width^2 / 12), and with it
 * what one cell holds, m^2 per axis. `along_m`: as nav_settings' motion_along_m. */
double nav_slice_fan(struct nav_pose step, double cell_theta, double along_m);

/* Adds to a shift and returns the whole cells it has gathered, at most `most` either way; beyond these the shift stays
 * within half a cell. */
int nav_slice_carry(double *shift, double by, double cell, int most);

/* Coordinates of `count` cells from `first` on, `step` apart, as the rows' loops take them. */
void nav_slice_coordinates(double first, double step, int count, float *out);

/* A slice's moments from its rows' sums. */
void nav_slice_moments(const struct nav_row_sums *, double moments[NAV_MOMENTS]);

#endif
