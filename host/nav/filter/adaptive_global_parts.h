/* What the files of the arena-wide belief share: spans of lines, planes, and the parts of a job. */
#ifndef NAV_ADAPTIVE_GLOBAL_PARTS_H
#define NAV_ADAPTIVE_GLOBAL_PARTS_H

#include "adaptive_global.h"

/* Passes of a job's position blur. */
enum { ADAPTIVE_PASSES_MOST = 4 };

/* Phases of a job for one slice each. A part that would touch more than `most` cells is not done; returns the number
 * touched, or -1. */
long adaptive_global_turn(struct adaptive_global *, int slice, long most);
long adaptive_global_move(struct adaptive_global *, int slice, long most);
long adaptive_global_count(struct adaptive_global *, int slice, long most);

/* Forgets the likelihoods of the job before. */
void adaptive_global_forget_values(struct adaptive_global *);

/* Makes the blurred headings the belief. */
void adaptive_global_turned(struct adaptive_global *);

/* Takes what the planes hold of a slice into the belief and multiplies it by the job's likelihood. */
void adaptive_global_weigh(struct adaptive_global *, int slice);

/* Works out the summary; at the end of a job. */
void adaptive_global_summarise(struct adaptive_global *);

/* The belief as slices, for its sums. */
struct nav_slices adaptive_global_slices(const struct adaptive_global *);

/* Heading of a slice, rad, not wrapped. */
static inline double adaptive_global_heading(const struct adaptive_global *g, int p)
{
    return nav_slice_heading(p, g->cell_theta, g->rotation);
}

/* Signatures of a line. */
static inline size_t adaptive_signature_pitch(const struct adaptive_global *g)
{
    return (size_t)g->pitch + 1;
}

static inline int adaptive_span_length(struct adaptive_span s)
{
    return s.end - s.begin;
}

/* Cells lo .. hi - 1 as a span of whole lanes within a line. */
static inline struct adaptive_span adaptive_span_of(const struct adaptive_global *g, int lo, int hi)
{
    lo = lo > 0 ? lo : 0;
    hi = hi < g->nx ? hi : g->nx;
    if (lo >= hi)
        return (struct adaptive_span){0, 0};
    return (struct adaptive_span){lo / NAV_LANES * NAV_LANES, (hi + NAV_LANES - 1) / NAV_LANES * NAV_LANES};
}

static inline struct adaptive_span adaptive_span_join(struct adaptive_span a, struct adaptive_span b)
{
    if (adaptive_span_length(a) == 0 || adaptive_span_length(b) == 0)
        return adaptive_span_length(a) == 0 ? b : a;
    return (struct adaptive_span){a.begin < b.begin ? a.begin : b.begin, a.end > b.end ? a.end : b.end};
}

/* A line's span moved by dx and grown by `by` on both sides. */
static inline struct adaptive_span adaptive_span_shifted(const struct adaptive_global *g, struct adaptive_span s,
                                                         int dx, int by)
{
    return adaptive_span_length(s) ? adaptive_span_of(g, s.begin + dx - by, s.end + dx + by) : s;
}

static inline struct adaptive_span *adaptive_spans(const struct adaptive_global *g, struct adaptive_span *of, int p)
{
    return of + (size_t)p * (size_t)g->ny;
}

/* Line j of a plane. Lines -1 and ny, and a few cells on both sides, are always empty. */
static inline float *adaptive_plane_line(const struct adaptive_global *g, int plane, int j)
{
    return g->plane[plane] + (size_t)(j + 1) * (size_t)(g->pitch + 2 * NAV_LANES) + NAV_LANES;
}

#endif
