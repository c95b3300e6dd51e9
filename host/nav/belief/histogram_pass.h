/* What the histogram's files share: lines written out, and a store that is written group by group. */
#ifndef NAV_HISTOGRAM_PASS_H
#define NAV_HISTOGRAM_PASS_H

#include <limits.h>
#include <string.h>

#include "histogram.h"

/* Cells that the blur of one pass reaches, and lines that it takes from. */
enum { NAV_BLUR_MOST = 4, NAV_BLUR_LINES = 2 * NAV_BLUR_MOST + 1 };

/* A group's cells, wherever they lie in memory. */
typedef float nav_lanes __attribute__((vector_size(NAV_LANES * sizeof(float)), aligned(sizeof(float)), may_alias));
typedef int32_t nav_lane_counts __attribute__((vector_size(NAV_LANES * sizeof(int32_t)), aligned(sizeof(int32_t))));

/* A line written out. Groups outside begin .. end - 1 hold nothing; some cells beyond both ends may be written. */
struct nav_line {
    float *cell;
    int begin, end;
};

/* Noise that a pass adds. */
struct nav_blur {
    int reach;                                           /* cells, of the position's */
    float along[NAV_BLUR_LINES], across[NAV_BLUR_LINES]; /* its kernels, their middle at [reach] */
    float side_turn;                                     /* weight of a neighbour in the headings' */
};

/* How far it is: the group of the line of the slice that is stored next (-1: the line is not begun), of lines before
 * `end`; those before `made` are written out. */
struct nav_progress {
    int slice, line, group, end, made;
    uint32_t groups; /* stored */
    long touched;
};

/* Sums of a line, by lane: mass, that times x, xx; cells with mass; heaviest cell. */
struct nav_line_sums {
    nav_lanes mass[3], peak;
    nav_lane_counts cells;
};

/* A pass under way. */
struct nav_pass {
    bool running;
    const struct nav_weigh *weigh;
    struct nav_blur blur;
    struct nav_progress at;
    int *roll_x, *roll_y; /* [nh] whole cells that slices move by */
    struct nav_line raw, blurred[NAV_BLUR_LINES];
    const float *row[NAV_BLUR_LINES]; /* lines that this one takes from, */
    int groups_end;                   /* and where their groups end */
    struct nav_line_sums sums;
    struct nav_pose about;
    double total;
    long cells;
    float heaviest; /* cell so far */
    struct nav_pose mode;
};

static inline void nav_line_widen(struct nav_line *line, int begin, int end)
{
    line->begin = begin < line->begin ? begin : line->begin;
    line->end = end > line->end ? end : line->end;
}

static inline void nav_line_clear(struct nav_line *line)
{
    if (line->end > line->begin)
        memset(line->cell + line->begin * NAV_LANES, 0,
               (size_t)(line->end - line->begin) * NAV_LANES * sizeof *line->cell);
    line->begin = INT_MAX;
    line->end = 0;
}

/* Whether any cell of a group holds mass: none is below 0. */
static inline bool nav_group_any(const float *mass)
{
    uint32_t bits[NAV_LANES], all = 0;
    memcpy(bits, mass, sizeof bits);
    for (int k = 0; k < NAV_LANES; k++)
        all |= bits[k];
    return all << 1 != 0;
}

/* Starts the store `next`, and makes it `now`. */
void nav_store_begin(struct nav_histogram *);
void nav_store_swap(struct nav_histogram *);

/* Adds a group to the store, when there is room; ends a line. */
static inline void nav_store_group(struct nav_histogram *h, int group, const float *mass)
{
    uint32_t n = h->pass->at.groups;
    if (n == h->room)
        return;
    h->next.at[n] = (uint16_t)group;
    memcpy(h->next.mass + (size_t)n * NAV_LANES, mass, NAV_LANES * sizeof *mass);
    h->pass->at.groups++;
}

static inline void nav_store_end_line(struct nav_histogram *h, size_t line)
{
    h->next.first[line + 1] = h->pass->at.groups;
}

/* Adds to a shift and returns the whole cells that it has gathered, at most `most` either way; beyond these the shift
 * stays within half a cell. */
int nav_histogram_carry(double *shift, double by, double cell, int most);

#endif
