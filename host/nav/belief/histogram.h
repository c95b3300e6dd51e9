/* A histogram over x, y and heading that takes memory and time where it holds mass.
 *
 * Each heading slice keeps its own shift in x and y and all slices share one rotation, so that motion does not smear:
 * only whole-cell moves are left to the cells, and odometry noise is added by blurs of the variance asked for. Of every
 * line of cells those groups of NAV_LANES are stored that hold mass, in the order of slices, lines and columns. Moves,
 * blurs, the likelihood and the sums for normalising are one pass from one store to another.
 *
 * Level n has cells 2^n times as wide as level 0: a belief can begin coarse and be refined when its mass sits in few
 * cells. */
#ifndef NAV_HISTOGRAM_H
#define NAV_HISTOGRAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "expected.h"
#include "gaussian.h"
#include "rng.h"

/* Cells of a group; and the sums of a slice: its mass and that times x, y, xx, xy, yy, relative to some place. */
enum { NAV_LANES = NAV_CELLS_AHEAD, NAV_MOMENTS = 6 };

/* Division of an arena into cells. */
struct nav_shape {
    int nx, ny, nh;
    int groups;              /* of a line */
    double cell, cell_theta; /* m, rad */
};

/* Divisions by level. A level has half the headings of the one below while that leaves `headings_least`. */
struct nav_levels {
    double size_x, size_y, cell; /* m; level 0's cell */
    int headings, headings_least;
};

struct nav_shape nav_levels_shape(const struct nav_levels *, int level);

/* Cells of all slices and lines, those that fill up a line's last group included. */
size_t nav_shape_cells(const struct nav_shape *);

/* Counts the cells without those. */
double nav_shape_inside(const struct nav_shape *);

/* Mass, cell by cell. */
struct nav_cells {
    uint32_t *first; /* [nh * ny + 1] groups of line n: first[n] .. first[n + 1] - 1 */
    uint16_t *at;    /* [room] a group's place in its line */
    float *mass;     /* [room][NAV_LANES] */
};

/* What a pass does besides moving. */
struct nav_weigh {
    /* Likelihoods of a group's cells after the move; those of cells without mass do not count, but are finite. Returns
     * what it took, in cells passed over. NULL: all are 1. */
    long (*group)(void *self, int slice, int line, int group, const float *mass, float *like);
    void *self;
    double least; /* cells with a smaller share are dropped before they are weighed */
    double extra; /* belief added to each cell before that, by the prior of its place; NULL: the same everywhere */
    double (*prior)(void *self, double x, double y);
};

/* Rows whose hazard is given at once, since a pass that gives it visits every cell: a robot that was carried is looked
 * for at most so much later. */
enum { NAV_HAZARD_ROWS = 16 };

/* A cell is dropped that holds less than this share of what a uniform belief gives each: it is below what a hazard of
 * 1e-3 gives in so many rows. */
#define NAV_SHARE_LEAST 0.01

struct nav_pass;

struct nav_histogram {
    struct nav_levels levels;
    int level;
    struct nav_shape shape;
    uint32_t room; /* groups */
    bool uniform;  /* and not written out */
    struct nav_cells now, next;
    /* Cell i of line j of slice p is centred at ((i + 1/2) cell + shift_x[p], (j + 1/2) cell + shift_y[p]), its heading
     * is (p + 1/2) cell_theta + rotation. */
    double rotation;
    double *shift_x, *shift_y; /* [nh] m, within half a cell */
    struct nav_pass *pass;
    double pending_position, pending_heading; /* variance not yet added, m^2 per axis, rad^2 */
    /* What the last pass found: */
    struct nav_pose about;         /* near it */
    double (*moment)[NAV_MOMENTS]; /* [nh] relative to that */
    double total;                  /* mass of all cells, in the cells' unit; */
    long cells;                    /* those that hold any */
    struct nav_pose mode;          /* centre of the heaviest cell, */
    float heaviest;                /* and what it holds */
};

/* Begins uniform at level `level`, whose cells there is room for, and `spare` more. 0, or -1 without memory or when
 * they are too many; nav_histogram_free either way. */
int nav_histogram_init(struct nav_histogram *, const struct nav_levels *, int level, size_t spare);
void nav_histogram_free(struct nav_histogram *);
size_t nav_histogram_bytes(const struct nav_histogram *);

/* Uniform; without any mass. Both unmoved, at a level. */
void nav_histogram_restart(struct nav_histogram *, int level);
void nav_histogram_clear(struct nav_histogram *, int level);

/* Room for the mass of all cells, [nh][ny][groups * NAV_LANES] and 0, of a level no finer than it began with; and for a
 * line's. Then takes what was written there. */
float *nav_histogram_write_out(struct nav_histogram *, float **line);
void nav_histogram_take(struct nav_histogram *);

/* A pose with mass, in the histogram's unit. */
struct nav_grain {
    struct nav_pose pose;
    double mass;
    int32_t next; /* of the same line; the histogram's */
};

/* Adds grains to the cells that hold them. */
void nav_histogram_add(struct nav_histogram *, struct nav_grain *, int32_t count);

/* Halves the cells; false when there is no room, or they are of level 0. */
bool nav_histogram_refine(struct nav_histogram *);

/* Groups that hold mass. */
uint32_t nav_histogram_groups(const struct nav_histogram *);

/* One pass: `step` in the robot's frame; pending noise is added as far as one pass can, whose share of a cell that is
 * left then stays pending. Sums will be relative to `about`. Returns how many cells were passed over. */
long nav_histogram_pass(struct nav_histogram *, struct nav_pose step, const struct nav_weigh *, struct nav_pose about);

/* Pending variance that one pass cannot add, in passes. */
double nav_histogram_debt(const struct nav_histogram *);

/* Variance that a drive adds to positions because headings differ within a slice (uniform: width^2 / 12), m^2 per axis.
 * `along_m`: as nav_motion_settings has it. */
double nav_histogram_fan(const struct nav_histogram *, struct nav_pose step, double along_m);

/* Heading of a slice, rad, not wrapped, and its shift, m. */
double nav_histogram_heading(const struct nav_histogram *, int slice);
double nav_histogram_shift_x(const struct nav_histogram *, int slice);
double nav_histogram_shift_y(const struct nav_histogram *, int slice);

/* Calls `take` for each cell that holds mass. */
void nav_histogram_each(const struct nav_histogram *, void (*take)(void *, struct nav_pose, double mass), void *self);

/* The cells moved by what is pending, as nav_filter_components lists them, masses times `mass`. */
long nav_histogram_components(const struct nav_histogram *, const struct nav_pending *, double mass,
                              struct nav_component *out, long room);

/* Mass of those components within NAV_NEAR_M and NAV_NEAR_RAD of a pose; all of them have 1. */
double nav_histogram_within(const struct nav_histogram *, const struct nav_pending *, struct nav_pose);

/* Poses drawn systematically, evenly within their cells: at most `room`, about `count`. */
long nav_histogram_draw(const struct nav_histogram *, struct nav_rng *, long count, struct nav_pose *out, long room);

/* Mass within NAV_NEAR_M and NAV_NEAR_RAD of a pose, the centres of cells deciding, in the cells' unit; and its mean
 * pose, when not NULL and there is any. */
double nav_histogram_near(const struct nav_histogram *, struct nav_pose, struct nav_pose *mean);

/* Of a belief with mass: the mean near its mode; returns the share near the mean, centres of cells deciding. */
double nav_histogram_mode(const struct nav_histogram *, struct nav_pose *mean);

/* Covariance about a pose of a belief with mass, moved by what is pending. */
void nav_histogram_covariance(const struct nav_histogram *, const struct nav_pending *, struct nav_pose, double out[9]);

#endif
