/* The adaptive filter's arena-wide belief: a coarse histogram that is asleep while the robot is known.
 *
 * It takes rows from the log in jobs and each job slice by slice (one slice per heading), so that any amount of work
 * can be spread over rows and none is done where no belief is: lines of cells without mass are left out. Rows without
 * contact that lie within a cell of each other make one job. As in lattice.h every slice has its own shift, so motion
 * does not smear. */
#ifndef NAV_ADAPTIVE_GLOBAL_H
#define NAV_ADAPTIVE_GLOBAL_H

#include "adaptive_cloud.h"
#include "adaptive_log.h"
#include "expected.h"

/* Likelihood of a signature, known when `job` is the present job's number. */
struct adaptive_value {
    uint32_t job;
    float value;
};

enum { ADAPTIVE_SUB = 2 }; /* poses of the table per cell edge, and per slice's width */

/* Cells are counted by powers of two of their mass, from 1 down. */
enum { ADAPTIVE_SIZES = 40 };

/* Some rows on their way into the belief. */
struct adaptive_job {
    bool running, turning; /* turning: still blurring headings */
    bool sized;            /* counting cells by size */
    int slice;             /* next to do */
    struct nav_pose step;
    float side; /* weight of a neighbour in a position blur of this job, 0: none; passes of it */
    int passes;
    float side_heading;
    float scale;      /* brings the mass before the job to 1 */
    double reference; /* log-likelihood of the best codes: factors are relative to it */
    double total;     /* mass so far */
    float heaviest;
    size_t mode;                   /* cell with the most mass so far */
    double local;                  /* log-likelihood of its rows by the local belief */
    uint64_t end;                  /* first row after it */
    uint32_t many[ADAPTIVE_SIZES]; /* cells by the size of their mass */
};

struct adaptive_global {
    const struct nav_problem *problem;
    struct nav_likelihood *likelihood; /* for what a whole cell covers */
    struct nav_expected *expected;
    int nx, ny, nh;
    double cell, cell_theta; /* m, rad */
    double rotation;         /* as in lattice.h */
    double *shift_x, *shift_y;
    float *mass, *scratch; /* [nh][ny][nx] */
    uint8_t *live;         /* [nh][ny] whether the line holds mass */
    double owed_position, owed_heading;
    double *moment;               /* [nh][6] mass, x, y, xx, xy, yy of each slice about the arena's corner */
    float **factor;               /* [whiskers][codes] likelihood of the present job, best 1 */
    struct adaptive_value *value; /* [signatures] */
    uint32_t jobs;
    struct adaptive_job job;
    bool fresh;                      /* uniform, and not yet written out */
    double log_free;                 /* logarithm of the share of cells where the robot can stand */
    uint64_t next;                   /* first row of the log that it has not seen */
    double total;                    /* mass */
    size_t mode;                     /* cell with the most mass, */
    double peak;                     /* and its share */
    double gained;                   /* log-likelihood of the rows seen, less the local belief's, since the restart */
    struct adaptive_summary summary; /* at row `next` - 1 */
    double room;                     /* hypotheses that a cloud could hold */
    double scattered;                /* share of mass in cells worth less than one of them */
    double crowd;                    /* cells that are worth more */
    long touched, distinct;          /* since they were last cleared */
};

/* 0, or -1 without memory; adaptive_global_free either way. */
int adaptive_global_init(struct adaptive_global *, const struct nav_problem *);
void adaptive_global_free(struct adaptive_global *);

/* Forgets everything: uniform before row `row` of the log. */
void adaptive_global_restart(struct adaptive_global *, uint64_t row);

/* Takes rows from the log until it has seen them all or the next slice would touch more than `budget` cells. */
void adaptive_global_work(struct adaptive_global *, struct adaptive_log *, long budget);

/* Whether every row of the log has been seen. */
bool adaptive_global_current(const struct adaptive_global *, const struct adaptive_log *);

/* Adds about `count` hypotheses drawn from the belief, of weight `weight` together, moved by `moved`. */
void adaptive_global_draw(struct adaptive_global *, struct adaptive_cloud *, long count, double weight,
                          struct nav_pose moved);

/* Mass near a pose, as of row `next` - 1. */
double adaptive_global_near(const struct adaptive_global *, struct nav_pose, struct nav_pose *mean);

/* Works out summary, scattered and crowd; at the end of a job. */
void adaptive_global_summarise(struct adaptive_global *);

/* Lists cells as nav_filter_components does, at the end of the log and then moved by `moved`, masses times `mass`.
 * Where a job is under way, slices that it has done are read after its rows and the others before them; headings keep
 * the shares that they had. */
long adaptive_global_list(const struct adaptive_global *, const struct adaptive_log *, struct nav_pose moved,
                          double mass, struct nav_component *out, long room);

/* Centre of cell n. */
struct nav_pose adaptive_global_centre(const struct adaptive_global *, size_t n);

/* Parts of a job, slice by slice: headings blurred into scratch, scratch made the belief, a slice moved and weighed. */
void adaptive_global_turn(struct adaptive_global *, int slice);
void adaptive_global_turned(struct adaptive_global *);
void adaptive_global_move(struct adaptive_global *, int slice);

/* Lines of a slice that hold mass. */
int adaptive_global_lines(const struct adaptive_global *, int slice);

/* Cells of a slice. */
static inline size_t adaptive_global_plane(const struct adaptive_global *g)
{
    return (size_t)g->ny * (size_t)g->nx;
}

size_t adaptive_global_cells(const struct adaptive_global *);
size_t adaptive_global_bytes(const struct adaptive_global *);

#endif
