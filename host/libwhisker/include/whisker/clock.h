/*
 * From the bridge's clock to the host's, in two steps. A frame's usb_time and the report `timing` say when its tick was
 * by the start-of-frame packets of the host's USB controller: exactly, and whether the ticks are even or not. That
 * controller's time is mapped to the host's clocks: frames arrive later than their tick by a delay that is never less
 * than a fixed latency and often much more. So the line that fits the clocks is the lower envelope of the arrivals: it
 * goes by the fastest frames and does not mind how late the others are. It holds on when the bridge is started again.
 * Where there are no start-of-frame packets the bridge's own time takes the place of the controller's.
 *
 * A fit belongs to one thread at a time; a struct whisker_clock is a value. No allocation.
 */
#ifndef WHISKER_CLOCK_H
#define WHISKER_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
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

/* The fastest arrival of one second: ns since the fit began by the controller's clock (by the bridge's at its nominal
 * rate), and its delay behind that. */
struct whisker_clock_point {
    double x_ns;
    double late_ns;
};

/* Maps a bridge's cycles to its USB controller's time, ns since some start of frame. */
struct whisker_clock_usb {
    double nominal_ns;      /* per cycle of the bridge */
    double rate_ns;         /* likewise, as found */
    uint64_t cycles;        /* of the latest tick, */
    double ns;              /* its date, */
    double doubt_ns;        /* and how far that may be off */
    uint64_t report_cycles; /* the same of the latest report */
    double report_ns;
    int64_t microframe; /* of the latest tick, counted on beyond the frame number's wrap */
    bool known, reported;
    bool even;        /* as the latest reports say: dates between them follow from the cycles */
    bool microframes; /* the bus has them: it runs at high speed */
};

/* A fit in progress. Owned by the caller; its fields are the library's. */
struct whisker_clock_fit {
    double nominal_ns; /* per cycle */
    int64_t latency_ns;
    uint64_t first_cycles, last_cycles;
    double first_x_ns; /* of the controller's clock, or the bridge's */
    double last_x_ns;  /* since then */
    struct whisker_clock_usb usb;
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
 * A frame of the bridge's time `cycles` has arrived just now, by both of the host's clocks; usb_time is that of its
 * header (0: not known). Of frames that come together the last one has the least delay. When the host's clock goes
 * back, when the clocks run apart by more than a crystal can, or, without usb_time, when cycles go back (the bridge was
 * started again), the fit begins anew. Returns 0, or HOST_CLOCK: CLOCK_MONOTONIC went back, or CLOCK_REALTIME was set
 * by more than 10 ms.
 */
int whisker_clock_add(struct whisker_clock_fit *fit, uint64_t cycles, uint16_t usb_time, int64_t monotonic_ns,
                      int64_t realtime_ns);

/* A report `timing` of the bridge, within a second of its latest frame: its tick was at the bridge's time `cycles`. A
 * few of them a second make dates exact that frames give to a microframe (125 us) only. */
void whisker_clock_report(struct whisker_clock_fit *fit, uint64_t cycles, uint16_t usb_time, uint16_t sof_cycles);

/* The mapping at the latest arrival; ns_per_cycle 0 before the first. */
void whisker_clock_get(const struct whisker_clock_fit *fit, struct whisker_clock *clock);
#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
