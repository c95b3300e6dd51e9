/*
 * From the bridge's clock to the host's. Frames carry the bridge's time; they arrive later by a delay that is never
 * less than a fixed latency and often much more. So the line that fits the clocks is the lower envelope of the
 * arrivals: it goes by the fastest frames and does not mind how late the others are.
 *
 * A fit belongs to one thread at a time; a struct whisker_clock is a value. No allocation.
 */
#ifndef WHISKER_CLOCK_H
#define WHISKER_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#pragma GCC visibility push(default)
/* cffi: begin */
/*
 * At device_cycles the host's clocks showed monotonic_ns (CLOCK_MONOTONIC) and realtime_ns (CLOCK_REALTIME); one cycle
 * takes ns_per_cycle. ns_per_cycle 0: not known yet.
 */
struct whisker_clock {
    uint64_t device_cycles;
    int64_t monotonic_ns;
    int64_t realtime_ns;
    double ns_per_cycle;
    double uncertainty_ns; /* half width, about 95 %: how far monotonic_ns may be off */
};

/* The host's clock, ns, when the bridge's showed `cycles` (also before or after those of the mapping). 0: not known. */
int64_t whisker_clock_to_monotonic(const struct whisker_clock *clock, uint64_t cycles);
int64_t whisker_clock_to_realtime(const struct whisker_clock *clock, uint64_t cycles);
/* cffi: end */

#define WHISKER_CLOCK_POINTS 32

/* The fastest arrival of one second: cycles as ns at the nominal rate since the fit began, and its delay behind that.
 */
struct whisker_clock_point {
    double x_ns;
    double late_ns;
};

/* A fit in progress. Owned by the caller; its fields are the library's. */
struct whisker_clock_fit {
    double nominal_ns; /* per cycle */
    int64_t latency_ns;
    uint64_t first_cycles, last_cycles;
    int64_t first_ns, last_ns;
    int64_t realtime_offset_ns;                             /* CLOCK_REALTIME minus CLOCK_MONOTONIC, as last seen */
    struct whisker_clock_point point[WHISKER_CLOCK_POINTS]; /* of past seconds, oldest first */
    struct whisker_clock_point best;                        /* of this second */
    int points;
    int late_points; /* seconds in a row whose fastest arrival was far too late */
    double skew;     /* of the line: ns of delay gained per ns */
    double late_ns;  /* of the line, at x_ns 0 */
    double spread_ns;
    bool begun;
    uint64_t restarts; /* times it began anew */
};

/*
 * Begins a fit. clock_hz: the bridge's nominal rate. latency_ns: the least time from a frame's tick to its arrival
 * (whisker_settings_latency_ns).
 */
void whisker_clock_begin(struct whisker_clock_fit *fit, uint32_t clock_hz, int64_t latency_ns);

/*
 * A frame of the bridge's time `cycles` has arrived just now, by both of the host's clocks. Of frames that come
 * together the last one tells most. When cycles go back (the bridge was started again), when the host's clock goes
 * back, or when the clocks run apart by more than a crystal can, the fit begins anew.
 * Returns 0, or HOST_CLOCK: CLOCK_MONOTONIC went back, or CLOCK_REALTIME was set by more than 10 ms.
 */
int whisker_clock_add(struct whisker_clock_fit *fit, uint64_t cycles, int64_t monotonic_ns, int64_t realtime_ns);

/* The mapping at the latest arrival; ns_per_cycle 0 before the first. */
void whisker_clock_get(const struct whisker_clock_fit *fit, struct whisker_clock *clock);
#pragma GCC visibility pop

#endif
