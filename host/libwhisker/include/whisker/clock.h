/* From the bridge's clock to the host's. */
#ifndef WHISKER_CLOCK_H
#define WHISKER_CLOCK_H

#include <stdint.h>

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
/* cffi: end */

#endif
