/* The adaptive filter's arena-wide belief: a histogram that is asleep while the robot is known.
 *
 * It takes rows from the log in jobs, each one pass over the cells that hold mass. Rows without contact that lie close
 * to each other make one job. It begins with cells as coarse as the arena asks for,
 * whose expectations are a table; whenever its mass sits in few enough of them they are refined, and what finer cells
 * expect is worked out where they hold mass. */
#ifndef NAV_ADAPTIVE_GLOBAL_H
#define NAV_ADAPTIVE_GLOBAL_H

#include "adaptive_log.h"
#include "expected.h"
#include "histogram.h"
#include "particles.h"

/* Hypotheses in each bin, half a cell each way, that they occupy. */
#define ADAPTIVE_PER_BIN 8.0

/* Some rows on their way into the belief. */
struct adaptive_job {
    struct nav_pose step;
    double reference; /* log-likelihood of the best codes: factors are relative to it */
    double local;     /* log-likelihood of its rows by the local belief */
    uint64_t end;     /* first row after it */
    bool uniform;     /* what it began from */
};

/* The level that it begins with. */
struct adaptive_first {
    int level;
    double cells;
    double too_wide;        /* m, edge of its cells where the scene's detail asks for smaller ones, else 0 */
    int slice;              /* whose place in the table is */
    struct nav_layer layer; /* this */
};

/* Poses on their way out and in. */
struct adaptive_poses {
    struct nav_pose *drawn;  /* [room] */
    struct nav_grain *grain; /* [room] collected, */
    int32_t grains;          /* so many */
};

struct adaptive_global {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood;
    struct nav_expected *expected; /* of the level that it begins with */
    struct nav_histogram histogram;
    struct nav_weigh weigh;
    struct adaptive_first first;
    struct nav_cell cell; /* the finest level's */
    double open;          /* share of the cells that can hold mass: the ground's */
    float **factor;       /* [whiskers][codes] log-likelihood of the present job */
    struct adaptive_job job;
    uint64_t next;           /* first row of the log that it has not seen */
    uint64_t hazarded;       /* row up to which the hazard was given */
    double gained;           /* log-likelihood of the rows seen, less the local belief's, since the restart */
    struct nav_mode summary; /* where it holds most, at row `next` - 1 */
    double room;             /* hypotheses that a cloud could hold */
    struct adaptive_poses poses;
    double scattered, crowd; /* share of mass in cells worth less than a hypothesis; cells that are worth more */
    long touched, distinct;  /* for the last row */
};

/* 0, or -1 without memory; adaptive_global_free either way. */
int adaptive_global_init(struct adaptive_global *, const struct nav_problem *, const struct nav_ground *);
void adaptive_global_free(struct adaptive_global *);

/* Forgets everything: uniform before row `row` of the log. */
void adaptive_global_restart(struct adaptive_global *, uint64_t row);

/* Holds nothing before row `row` of the log, in its finest cells; for adaptive_global_add. */
void adaptive_global_clear(struct adaptive_global *, uint64_t row);

/* Holds the problem's mixture before the first row. Returns how many equal cells of the finest level it is
 * worth. */
double adaptive_global_fill(struct adaptive_global *);

/* Takes rows from the log until it has seen them all, or the next ones are better left to the next row. hazard: as
 * motion.hazard, of a belief that is all there is; 0 else. */
void adaptive_global_work(struct adaptive_global *, struct adaptive_log *, double hazard);

/* Whether every row of the log has been seen. */
bool adaptive_global_current(const struct adaptive_global *, const struct adaptive_log *);

/* Adds about `count` particles drawn from the belief, of weight `weight` together, moved by `moved`. */
void adaptive_global_draw(struct adaptive_global *, struct nav_particles *, struct nav_rng *, long count, double weight,
                          struct nav_pose moved);

/* Share of the belief that belongs to each mode: a cell belongs to the mode that it is nearest to. */
void adaptive_global_share(const struct adaptive_global *, const struct nav_mode *, int modes, double *share);

/* Collects a pose that is to get `share` of what all cells hold; then adds those collected. Between jobs. */
void adaptive_global_add(struct adaptive_global *, struct nav_pose, double share);
void adaptive_global_added(struct adaptive_global *);

/* Motion from the belief's row to the end of the log, and then what is pending, with the noise of all. */
struct nav_pending adaptive_global_since(const struct adaptive_global *, const struct adaptive_log *,
                                         const struct nav_pending *);

/* Cells of the level that it is at; bytes of all. */
size_t adaptive_global_cells(const struct adaptive_global *);
size_t adaptive_global_bytes(const struct adaptive_global *);

#endif
