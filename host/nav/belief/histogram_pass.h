/* What the histogram's files share: lines written out, and a store that is written group by group. */
#ifndef NAV_HISTOGRAM_PASS_H
#define NAV_HISTOGRAM_PASS_H

#include "histogram.h"

/* Cells that the blur of one pass reaches, and lines that it takes from. */
enum { NAV_BLUR_MOST = 4, NAV_BLUR_LINES = 2 * NAV_BLUR_MOST + 1 };

/* A line written out. Groups that are not marked hold nothing; some cells beyond both ends may be written. */
struct nav_line {
    float *cell;
    uint64_t *mark;
};

/* Noise that a pass adds. */
struct nav_blur {
    int reach;                                           /* cells, of the position's */
    float along[NAV_BLUR_LINES], across[NAV_BLUR_LINES]; /* its kernels, their middle at [reach] */
    float side_turn;                                     /* weight of a neighbour in the headings' */
};

/* How far it is: what is stored next, of lines before `end`; those before `made` are written out. */
struct nav_progress {
    int slice, line, end, made;
    bool open;       /* the line is in `todo` */
    uint32_t groups; /* stored */
    long touched;
};

/* A pass under way. */
struct nav_pass {
    bool running;
    const struct nav_weigh *weigh;
    struct nav_blur blur;
    struct nav_progress at;
    int *roll_x, *roll_y; /* [nh] whole cells that slices move by */
    struct nav_line raw, todo, blurred[NAV_BLUR_LINES];
    const float *row[NAV_BLUR_LINES];         /* lines that this one takes from */
    float sum[3][NAV_LANES], peak[NAV_LANES]; /* of the line, by lane: mass, times x, xx; heaviest cell */
    struct nav_pose about;
    double total;
    long cells;
    float heaviest; /* cell so far */
    struct nav_pose mode;
};

/* Words of a line's marks. */
static inline int nav_line_words(const struct nav_shape *s)
{
    return (s->groups + 63) / 64;
}

static inline void nav_line_note(struct nav_line *line, const struct nav_shape *s, int group)
{
    if (group >= 0 && group < s->groups)
        line->mark[group / 64] |= (uint64_t)1 << group % 64;
}

/* First marked group from `group` on; `groups` when there is none. */
int nav_line_next(const struct nav_line *, const struct nav_shape *, int group);

/* Empties marked groups. */
void nav_line_clear(struct nav_line *, const struct nav_shape *);

/* Starts the store `next`, adds a group or ends a line, and makes it `now`. */
void nav_store_begin(struct nav_histogram *);
void nav_store_group(struct nav_histogram *, int group, const float mass[NAV_LANES]);
void nav_store_end_line(struct nav_histogram *, size_t line);
void nav_store_swap(struct nav_histogram *);

/* Adds to a shift and returns the whole cells that it has gathered, at most `most` either way; beyond these the shift
 * stays within half a cell. */
int nav_histogram_carry(double *shift, double by, double cell, int most);

#endif
