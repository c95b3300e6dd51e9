#include "clock_trace.h"

#include <math.h>

#define BATCH_CYCLES 480000.0
#define WARMING 3e-6
#define WANDER 2e-8        /* per batch: 2e-7 in a hundred, some 1e-5 in an hour */
#define LEAST_NS 20e3      /* the host's least delay */
#define USUAL_NS 150e3     /* mean of what comes on top */
#define STALL_CHANCE 0.002 /* every four seconds the machine is away for up to 60 ms */
#define STALL_NS 60e6
#define ORDER_NS 1e3 /* between arrivals that waited together */

/* splitmix64, as a number in (0, 1]. */
static double uniform(struct clock_trace *trace)
{
    uint64_t z = trace->random += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    return ((double)((z ^ z >> 31) >> 11) + 1) * 0x1.0p-53;
}

void clock_trace_begin(struct clock_trace *trace, uint64_t seed)
{
    *trace = (struct clock_trace){.random = seed, .true_ns = 1e12};
    trace->skew = (uniform(trace) - 0.5) * 200e-6;
    trace->period_s = 600 + 1800 * uniform(trace);
}

struct clock_arrival clock_trace_next(struct clock_trace *trace)
{
    const double turn = 2 * 3.141592653589793 * trace->true_ns * 1e-9 / trace->period_s;
    trace->wander += WANDER * (uniform(trace) - 0.5);
    const double skew = trace->skew + trace->wander + WARMING * sin(turn);
    trace->cycles += BATCH_CYCLES;
    trace->true_ns += BATCH_CYCLES * (1e9 / TRACE_CLOCK_HZ) * (1 + skew);
    const double ready_ns = trace->true_ns + TRACE_LATENCY_NS + LEAST_NS;
    if (uniform(trace) < STALL_CHANCE) {
        trace->busy_until_ns = ready_ns + STALL_NS * uniform(trace);
    }
    const double late_ns = -USUAL_NS * log(uniform(trace));
    trace->last_ns = fmax(fmax(ready_ns, trace->busy_until_ns) + late_ns, trace->last_ns + ORDER_NS);
    return (struct clock_arrival){
        .cycles = (uint64_t)trace->cycles,
        .true_ns = trace->true_ns,
        .arrival_ns = (int64_t)trace->last_ns,
    };
}
