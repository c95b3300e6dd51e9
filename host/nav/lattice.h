/* The grid filter's belief: a histogram over x, y and heading that follows the robot without smearing.
 *
 * Each heading slice keeps its own shift in x and y and all slices share one rotation, so a motion of any size only
 * changes these numbers; what is left to the cells are whole-cell moves. Motion thus adds no numerical diffusion, and
 * odometry noise is added by small blurs of exactly the variance asked for. */
#ifndef NAV_LATTICE_H
#define NAV_LATTICE_H

#include <stddef.h>

#include "filter.h"
#include "motion.h"
#include "pose.h"

struct nav_lattice {
    int nx, ny, nh;
    double cell, cell_theta;   /* m, rad */
    double rotation;           /* rad: slice p has heading (p + 1/2) cell_theta + rotation */
    double *shift_x, *shift_y; /* [nh] m, within half a cell: cell i is centred at (i + 1/2) cell + shift */
    float *mass;               /* [nh][ny][nx] */
    float *scratch;            /* as mass */
    double owed_position;      /* variance not yet added, m^2 per axis, rad^2 */
    double owed_heading;
};

/* 0, or -1 without memory. */
int nav_lattice_init(struct nav_lattice *, double size_x, double size_y, double cell, int headings);
void nav_lattice_free(struct nav_lattice *);

size_t nav_lattice_cells(const struct nav_lattice *);
double nav_lattice_heading(const struct nav_lattice *, int slice);
float *nav_lattice_slice(const struct nav_lattice *, int slice);

/* Moves the belief by `step` (in the robot's frame) and adds noise; mass that leaves the lattice is lost. */
void nav_lattice_move(struct nav_lattice *, struct nav_pose step, const struct nav_noise *);

/* Fills the lattice with a prior's mass, not yet clipped to free space. */
void nav_lattice_fill(struct nav_lattice *, const struct nav_prior *);

/* Multiplies all cells. */
void nav_lattice_scale(struct nav_lattice *, double factor);

/* Mass within NAV_NEAR_M and NAV_NEAR_RAD of a pose, the centres of cells deciding; and its mean pose, when not NULL.
 */
double nav_lattice_near(const struct nav_lattice *, struct nav_pose, struct nav_pose *mean);

/* Centre of cell number `index` of `mass`. */
struct nav_pose nav_lattice_centre(const struct nav_lattice *, size_t index);

/* Centre of the cell with the most mass. */
struct nav_pose nav_lattice_mode(const struct nav_lattice *);

/* Covariance of the whole belief about a pose, the spread within a cell included; row-major, m and rad. */
void nav_lattice_covariance(const struct nav_lattice *, struct nav_pose about, double covariance[9]);

#endif
