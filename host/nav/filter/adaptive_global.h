/* The adaptive filter's arena-wide belief: a coarse histogram that is asleep while the robot is known.
 *
 * It takes rows from the log in jobs and each job slice by slice (one slice per heading), so that any amount of work
 * can be spread over rows and none is done where no belief is: of a line of cells only the span that holds mass. Rows
 * without contact that lie within a cell of each other make one job. As in lattice.h every slice has its own shift, so
 * motion does not smear. */
#ifndef NAV_ADAPTIVE_GLOBAL_H
#define NAV_ADAPTIVE_GLOBAL_H

#include "adaptive_log.h"
#include "expected.h"
#include "particles.h"
#include "slices.h"

/* Cells begin .. end - 1 of a line, whole lanes of them (lattice_rows.h); empty: both 0. */
struct adaptive_span {
    int begin, end;
};

/* What a job does, slice by slice: blurs headings, moves and weighs, counts the cells worth a hypothesis. */
enum adaptive_phase { ADAPTIVE_TURN, ADAPTIVE_MOVE, ADAPTIVE_COUNT };

enum { ADAPTIVE_SUB = 2 }; /* poses of the table per cell edge, and per slice's width */

/* Some rows on their way into the belief. */
struct adaptive_job {
    bool running;
    enum adaptive_phase phase;
    int slice; /* next to do */
    struct nav_pose step;
    float side; /* weight of a neighbour in a position blur of this job, 0: none; passes of it */
    int passes;
    float side_heading;
    float scale;           /* brings the mass before the job to 1 */
    double reference;      /* log-likelihood of the best codes: factors are relative to it */
    double total;          /* mass so far */
    float heaviest;        /* cell so far, */
    int mode_slice;        /* and its slice */
    struct nav_pose about; /* moments of its slices are relative to this place */
    double local;          /* log-likelihood of its rows by the local belief */
    uint64_t end;          /* first row after it */
    double worth;          /* mass of a cell that is worth one hypothesis */
    double light, crowd;   /* mass of cells below that, and how many are not */
};

struct adaptive_global {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood; /* for what a whole cell covers */
    struct nav_expected *expected;
    int nx, ny, nh, pitch;   /* pitch: nx in whole lanes; cells beyond nx are empty */
    double cell, cell_theta; /* m, rad */
    double wanted;           /* m, edge of a cell that the scene's detail asks for */
    double budget;           /* cells and hypotheses touched per row, at most */
    double rotation;         /* as in lattice.h */
    double *shift_x, *shift_y;
    float *mass, *turned;                     /* [nh][ny][pitch] the belief, and where headings are blurred to */
    struct adaptive_span *span, *span_turned; /* [nh][ny] beyond which a line is empty */
    struct adaptive_span *moved, *region;     /* [ny] of the slice that moves: its cells before and after blurs */
    float *plane[2];                          /* [ny + 2][pitch + 2 lanes] empty but for the slice that moves */
    float *coordinate;                        /* [pitch] of a line's cells in x */
    float *like;                              /* [ny][pitch] likelihoods of a slice, */
    int *missing;                             /* [pitch] and those of a line that are still to be worked out */
    double owed_position, owed_heading;
    double (*moment)[NAV_MOMENTS]; /* [nh] of each slice */
    float **factor;                /* [whiskers][codes] log-likelihood of the present job */
    uint32_t *signature;           /* [expected->nh][SUB][SUB][ny + 1][pitch + 1]: by phase in y and x */
    float *value;                  /* [signatures] likelihood in the present job, negative: not yet worked out */
    uint32_t *known, knowns;       /* those worked out */
    struct adaptive_job job;
    bool fresh;                 /* uniform, and not yet written out */
    double log_free;            /* logarithm of the share of cells where the robot can stand */
    uint64_t next;              /* first row of the log that it has not seen */
    double total;               /* mass */
    size_t mode;                /* stored cell with the most mass */
    double gained;              /* log-likelihood of the rows seen, less the local belief's, since the restart */
    struct nav_summary summary; /* at row `next` - 1 */
    double room;                /* hypotheses that a cloud could hold */
    double scattered;           /* share of mass in cells worth less than one of them */
    double crowd;               /* cells that are worth more */
    long touched, distinct;     /* since they were last cleared */
};

/* 0, or -1 without memory; adaptive_global_free either way. */
int adaptive_global_init(struct adaptive_global *, const struct nav_problem *);
void adaptive_global_free(struct adaptive_global *);

/* Forgets everything: uniform before row `row` of the log. */
void adaptive_global_restart(struct adaptive_global *, uint64_t row);

/* Holds nothing before row `row` of the log; for adaptive_global_add. */
void adaptive_global_clear(struct adaptive_global *, uint64_t row);

/* Takes rows from the log until it has seen them all or the next slice would touch more than `budget` cells. */
void adaptive_global_work(struct adaptive_global *, struct adaptive_log *, long budget);

/* Whether every row of the log has been seen. */
bool adaptive_global_current(const struct adaptive_global *, const struct adaptive_log *);

/* Adds about `count` particles drawn from the belief, of weight `weight` together, moved by `moved`. */
void adaptive_global_draw(struct adaptive_global *, struct nav_particles *, struct nav_rng *, long count, double weight,
                          struct nav_pose moved);

/* Share of the belief that belongs to each mode, between jobs: a cell belongs to the mode that it is nearest to. */
void adaptive_global_share(const struct adaptive_global *, const struct nav_mode *, int modes, double *share);

/* Adds to the cell that holds a pose, between jobs: `share` of what all cells hold. The total stays what it was. */
void adaptive_global_add(struct adaptive_global *, struct nav_pose, double share);

/* Lists cells as nav_filter_components does, at the end of the log and then moved by `moved`, masses times `mass`.
 * Where a job is under way, slices that it has done are read after its rows and the others before them; headings keep
 * the shares that they had. */
long adaptive_global_list(const struct adaptive_global *, const struct adaptive_log *, struct nav_pose moved,
                          double mass, struct nav_component *out, long room);

/* First cell of a line. */
static inline float *adaptive_global_line(const struct adaptive_global *g, float *mass, int p, int j)
{
    return mass + ((size_t)p * (size_t)g->ny + (size_t)j) * (size_t)g->pitch;
}

/* Cells of the arena; cells of the arrays, those beyond nx included. */
size_t adaptive_global_cells(const struct adaptive_global *);
size_t adaptive_global_stored(const struct adaptive_global *);
size_t adaptive_global_bytes(const struct adaptive_global *);

#endif
