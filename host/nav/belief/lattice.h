/* The grid filter's belief: a histogram over x, y and heading that follows the robot without smearing.
 *
 * Each heading slice keeps its own shift in x and y and all slices share one rotation, so a motion of any size only
 * changes these numbers; what is left to the cells are whole-cell moves. Motion thus adds no numerical diffusion, and
 * odometry noise is added by small blurs of exactly the variance asked for. Moves, blurs, the likelihood and the sums
 * for normalising are one pass over the cells (lattice_pass.c). */
#ifndef NAV_LATTICE_H
#define NAV_LATTICE_H

#include <stddef.h>

#include "motion.h"
#include "pose.h"
#include "problem.h"
#include "slices.h"

struct nav_lattice {
    int nx, ny, nh;
    double cell, cell_theta;   /* m, rad */
    double rotation;           /* rad: slice p has heading (p + 1/2) cell_theta + rotation */
    double *shift_x, *shift_y; /* [nh] m, within half a cell: cell i is centred at (i + 1/2) cell + shift */
    int *roll_x, *roll_y;      /* [nh] whole cells that the next pass moves a slice by */
    float *mass;               /* [nh][ny][nx], before that; times `scale` it is the belief */
    double scale;
    float *spare;         /* as mass: where the next pass writes */
    float *rows;          /* of the pass, see there */
    double owed_position; /* variance not yet added, m^2 per axis, rad^2 */
    double owed_heading;
    /* Of the last pass, in units of `mass`: */
    double (*moment)[NAV_MOMENTS]; /* [nh] mass and its sums times x, y, xx, xy, yy, relative to */
    double moment_x, moment_y;     /* this place, m */
    double total;                  /* mass of all cells */
    int peak_slice;                /* with the largest cell */
};

/* Likelihood and limits of a pass. */
struct nav_lattice_weigh {
    /* Likelihoods of cells begin .. end - 1 of a row of a slice. */
    void (*row)(const void *self, int slice, int row, int begin, int end, float *out);
    const void *self;
    const int *begin, *end; /* [ny] cells outside begin .. end - 1 hold nothing, before and after */
    double extra;           /* belief added to each cell before weighing */
};

/* 0, or -1 without memory. */
int nav_lattice_init(struct nav_lattice *, double size_x, double size_y, double cell, int headings);
void nav_lattice_free(struct nav_lattice *);

size_t nav_lattice_cells(const struct nav_lattice *);
double nav_lattice_heading(const struct nav_lattice *, int slice);
float *nav_lattice_slice(const struct nav_lattice *, int slice);

/* Moves the belief by `step` (in the robot's frame): slices turn and shift; whole cells wait for the next pass, noise
 * is owed. */
void nav_lattice_shift(struct nav_lattice *, struct nav_pose step, const struct nav_noise *);

/* Moves whole cells, adds noise that is due and multiplies by likelihoods. Mass that leaves the lattice is lost.
 * `about`: near where most of the belief is expected, for precision. Work: one reading and one writing of all cells;
 * more only for noise beyond half a squared cell edge, at most 100 of these. */
void nav_lattice_pass(struct nav_lattice *, const struct nav_lattice_weigh *, struct nav_pose about);

/* Fills the lattice with a prior's mass, not yet clipped to free space. */
void nav_lattice_fill(struct nav_lattice *, const struct nav_prior *);

/* The belief as slices, for its sums; the moments are those of the last pass. */
struct nav_slices nav_lattice_slices(const struct nav_lattice *);

/* Number of the first cell of a slice that holds the most mass. */
size_t nav_lattice_peak(const struct nav_lattice *, int slice);

/* Empties all cells outside begin .. end - 1 of each row, in every slice. */
void nav_lattice_clip(struct nav_lattice *, const int *begin, const int *end);

#endif
