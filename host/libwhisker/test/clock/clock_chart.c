/* Writes an hour of a synthetic trace as CSV, for the chart: t_s, delay_us, error_us, uncertainty_us. Usage: SEED. */
#include <stdio.h>
#include <stdlib.h>

#include "clock_trace.h"
#include "whisker/clock.h"

#define ARRIVALS 450000
#define ROW 125 /* one row per second */

int main(int argc, char **argv)
{
    struct clock_trace trace;
    struct whisker_clock_fit fit;
    clock_trace_begin(&trace, argc > 1 ? strtoull(argv[1], NULL, 10) : 1);
    whisker_clock_begin(&fit, TRACE_CLOCK_HZ, TRACE_LATENCY_NS);
    printf("t_s,delay_us,error_us,uncertainty_us\n");
    for (int i = 0; i < ARRIVALS; i++) {
        const struct clock_arrival now = clock_trace_next(&trace);
        struct whisker_clock clock;
        whisker_clock_add(&fit, now.cycles, 0, now.arrival_ns, now.arrival_ns);
        if (i % ROW == 0) {
            whisker_clock_get(&fit, &clock);
            printf("%.3f,%.2f,%.2f,%.2f\n", (double)now.cycles / TRACE_CLOCK_HZ,
                   ((double)now.arrival_ns - now.true_ns - TRACE_LATENCY_NS) * 1e-3,
                   ((double)clock.monotonic_ns - now.true_ns) * 1e-3, clock.uncertainty_ns * 1e-3);
        }
    }
    return 0;
}
