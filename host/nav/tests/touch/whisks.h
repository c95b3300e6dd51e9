/* Whisks drawn by hand: rest, push at a steady rate, hold, way back, rest. */
#ifndef WHISKS_H
#define WHISKS_H

#include <math.h>

#include "contact_shape.h"

struct drawn_whisk {
    double hz, lead_s, push_s, hold_s, tail_s;
    double peak;     /* along the first two axes as 0.6, -0.8; of one axis as 1 */
    double noise;    /* amplitude of a deterministic jitter */
    double rate;     /* commanded, rad/s; 0: not known */
    double reported; /* reported, rad/s; 0: not known */
    int bad_every;   /* every so many samples a wild one; 0: none */
    int nan_every;   /* every so many samples a NAN; 0: none */
    double frozen_s; /* from here on the sample does not change; 0: never */
    double clip;     /* deflections beyond are clipped; 0: none */
    double cut_s;    /* the recording ends here; 0: whole */
};

static inline struct drawn_whisk usual_whisk(void)
{
    return (struct drawn_whisk){.hz = 2000, .lead_s = 0.2, .push_s = 0.6, .tail_s = 0.3, .peak = 1500, .noise = 10};
}

static inline double drawn_deflection(const struct drawn_whisk *w, double t)
{
    double back = w->lead_s + w->push_s + w->hold_s;
    double up = (t - w->lead_s) / w->push_s, down = 1.0 - (t - back) / w->push_s;
    double share = fmax(0.0, fmin(1.0, fmin(up, down)));
    double value = share * w->peak;
    return w->clip > 0.0 && value > w->clip ? w->clip : value;
}

static inline double drawn_end(const struct drawn_whisk *w)
{
    return w->cut_s > 0.0 ? w->cut_s : w->lead_s + 2.0 * w->push_s + w->hold_s + w->tail_s;
}

static inline void draw_whisk(struct nav_trace *trace, const struct drawn_whisk *w, int axes)
{
    nav_trace_begin(trace, axes);
    int n = (int)floor(drawn_end(w) * w->hz);
    for (int i = 0; i < n; i++) {
        double t = i / w->hz, seen = w->frozen_s > 0.0 && t > w->frozen_s ? w->frozen_s : t;
        double value = drawn_deflection(w, seen), scatter = 43758.5453 * sin(12.9898 * floor(seen * w->hz + 0.5));
        double jitter = w->noise * (2.0 * (scatter - floor(scatter)) - 1.0);
        double sample[NAV_TRACE_AXES] = {0};
        sample[0] = 30000.0 + (axes == 1 ? 1.0 : 0.6) * value + jitter;
        if (axes > 1)
            sample[1] = 31000.0 - 0.8 * value + jitter;
        if (w->bad_every > 0 && i % w->bad_every == 7)
            sample[0] = 1000.0 + 37.0 * i;
        if (w->nan_every > 0 && i % w->nan_every == 3 % w->nan_every)
            sample[axes - 1] = (double)NAN;
        nav_trace_add(trace, 5.0 + t, sample, w->rate > 0.0 ? w->rate : (double)NAN,
                      w->reported > 0.0 ? w->reported : (double)NAN);
    }
}

static inline struct nav_shape shape_of_whisk(const struct drawn_whisk *w, int axes)
{
    static struct nav_trace trace;
    struct nav_shape shape;
    draw_whisk(&trace, w, axes);
    nav_shape_of(&trace, &shape);
    return shape;
}

#endif
