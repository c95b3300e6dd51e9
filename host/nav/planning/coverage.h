/* Where to drive on: the way over a map, as it stands, that sweeps most new floor a second.
 *
 * A state is a cell and one of eight headings. The fastest ways to all states, turns included, are found in the order
 * of their time (Dijkstra). A way sweeps fresh floor beside it; each cell counts by the probability that nothing stops
 * the robot before it. Work is counted in states, never in time, so that the same map gives the same plan on any
 * machine; when the budget is spent, the best way so far stands. Nothing is allocated after nav_coverage_new. */
#ifndef NAV_COVERAGE_H
#define NAV_COVERAGE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
enum { NAV_COVERAGE_CORNERS_MOST = 32, NAV_COVERAGE_ASIDES_MOST = 64, NAV_COVERAGE_CELLS_MOST = 1 << 18 };

/* By cell, row 0 the smallest y. The caller owns the arrays. */
struct nav_coverage_ground {
    int columns, rows;
    double x, y, cell;    /* lower left corner, edge of a cell: m */
    const float *open;    /* [rows][columns] probability that nothing stops the robot's middle in a cell; 0: no way */
    const uint8_t *fresh; /* [rows][columns] 1: floor that was not swept */
};

struct nav_coverage_options {
    double drive_m_s, turn_rad_s;
    double begin_s;      /* that beginning a turn costs */
    double stopped_s;    /* that being stopped costs */
    double least_m2;     /* a way that is expected to sweep less is no choice */
    long budget;         /* states; 0: no limit */
    int asides;          /* 0 .. NAV_COVERAGE_ASIDES_MOST */
    const double *aside; /* [asides] what is swept, a cell's edge wide each: to the left of the robot's middle, m */
};

struct nav_coverage_plan {
    int corners;                         /* 0: nothing is worth its time */
    double x[NAV_COVERAGE_CORNERS_MOST]; /* where it turns, and the end: m. Only the first ones of more */
    double y[NAV_COVERAGE_CORNERS_MOST];
    double swept_m2, seconds; /* expected of it */
    double passed;            /* probability that nothing stops it */
    long spent;               /* of the budget */
};

struct nav_coverage;

/* For grounds of up to so many cells. Copies options. NULL: no memory, or out of range. */
struct nav_coverage *nav_coverage_new(int cells, const struct nav_coverage_options *);
void nav_coverage_free(struct nav_coverage *);

/* The best way from a pose (x, y: m, turn: rad). Without corners where the ground has more cells than were asked for,
 * or the pose is not on it. */
void nav_coverage_plan(struct nav_coverage *, const struct nav_coverage_ground *, double x, double y, double turn,
                       struct nav_coverage_plan *out);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
