/* Takes out of a window what no floor writes: missing records, spikes; and reports stuck and railed channels. */
#ifndef NAV_TEXTURE_CLEAN_H
#define NAV_TEXTURE_CLEAN_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
/* What the training recordings showed of each channel; any array may be NULL: then nothing of that kind is doubted. */
struct nav_texture_limits {
    int channels;
    const double *spike; /* [channels] counts: no sample stands out farther than this from both its neighbours */
    const double *still; /* [channels] samples: no longer run of equal values */
    const double *low,
        *high;          /* [channels] counts: a run of two or more at or beyond one of these is a sensor at its stop */
    const double *span; /* [channels] counts: no window reaches farther from its lowest to its highest sample */
};

struct nav_texture_health {
    long bad;   /* samples left out, missing or spikes, of the channel that has most */
    int still;  /* channels that never change for too long */
    int railed; /* channels at a stop */
    int caught; /* channels that bend farther than any trained floor bends them */
};

/* window: [n][channels], in place: a sample with a value that is not finite or beyond +-1e9, or that is a spike, is
 * replaced by the straight line between its good neighbours (at an end: the nearest). All are 0 when none is good. */
struct nav_texture_health nav_texture_clean(double *window, int n, const struct nav_texture_limits *);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
