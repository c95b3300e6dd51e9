/* One contact's samples in constant memory, whatever their rate, number and units: spikes taken out, then averaged into
 * at most NAV_TRACE_BINS bins of equally many samples. When the bins are full, neighbours are joined.
 */
#ifndef NAV_CONTACT_TRACE_H
#define NAV_CONTACT_TRACE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
enum { NAV_TRACE_BINS = 128, NAV_TRACE_AXES = 8, NAV_TRACE_MEDIAN = 5 };

/* A sample, or the sum of several. */
struct nav_trace_point {
    double t_s;
    double turn;               /* commanded angle turned since the first sample, rad; seconds where no rate is known */
    double reported;           /* the same of the rate the base reports */
    double at[NAV_TRACE_AXES]; /* channels, any unit */
};

struct nav_trace {
    int axes;
    int used;       /* bins begun */
    int width;      /* samples a full bin holds */
    double start_s; /* time of the first sample; the times below count from it */
    int filled;     /* samples in the last bin begun */
    struct nav_trace_point sum[NAV_TRACE_BINS];
    struct nav_trace_point recent[NAV_TRACE_MEDIAN];    /* the last samples, in a ring */
    long good, bad;                                     /* samples taken; samples with a number that is not finite */
    int equal[NAV_TRACE_AXES], longest[NAV_TRACE_AXES]; /* samples in a row equal to the one before: now; ever */
    struct nav_trace_point last;                        /* the last good sample */
};

/* Begins a trace of 1..NAV_TRACE_AXES channels; more are not looked at. */
void nav_trace_begin(struct nav_trace *, int axes);

/* Takes one sample at a time t_s later than all before. whisk_rad_s: the commanded rate of turn, NAN: not known;
 * reported_rad_s: the rate the base reports, NAN: not known. A sample with a channel or time that is not finite, or not
 * later, is counted as bad and left out. Each channel goes through a median of NAV_TRACE_MEDIAN samples, so that bad
 * records do not count; the first and last two samples are not binned. */
void nav_trace_add(struct nav_trace *, double t_s, const double *sample, double whisk_rad_s, double reported_rad_s);

/* Takes n samples [n][axes] with times [n] and rates [n]; a NULL rate is not known. */
void nav_trace_run(struct nav_trace *, size_t n, const double *t_s, const double *samples, const double *whisk_rad_s,
                   const double *reported_rad_s);
/* cffi: end */

/* 1 over the samples in a bin: its sums times this are its means. */
static inline double nav_trace_share(const struct nav_trace *trace, int bin)
{
    return 1.0 / (bin == trace->used - 1 ? trace->filled : trace->width);
}

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
