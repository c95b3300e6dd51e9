#include "clock_trace.h"

#include <math.h>

#define BATCH_CYCLES 480000.0
#define WARMING 3e-6
#define WANDER 2e-8        /* per batch: 2e-7 in a hundred, some 1e-5 in an hour */
#define LEAST_NS 20e3      /* the host's least delay */
#define USUAL_NS 150e3     /* mean of what comes on top */
#define STALL_CHANCE 0.002 /* every four seconds the machine is away for up to 60 ms */
#define STALL_NS 60e6
#define PAUSE_CHANCE 0.001
#define AWAY_NS 700e6 /* until a bridge that is started again sends */
#define BATCH_TICKS 16
#define MICROFRAME_NS 125e3
#define MICROFRAMES 16384
#define USB_TIME_KNOWN 0x8000
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
    trace->begun_ns = trace->true_ns;
}

/* The time from a batch's last tick to the next one's; the bridge counts BATCH_CYCLES whatever it is. */
static double step(struct clock_trace *trace)
{
    const struct clock_source *source = &trace->source;
    const double turn = 2 * 3.141592653589793 * trace->true_ns * 1e-9 / trace->period_s;
    const double batch_ns = BATCH_CYCLES * (1e9 / TRACE_CLOCK_HZ);
    trace->wander += WANDER * (uniform(trace) - 0.5);
    const double skew = trace->skew + trace->wander + WARMING * sin(turn);
    double step_ns = batch_ns * (1 + skew) * (1 + source->off);
    trace->cycles += BATCH_CYCLES;
    if (source->uneven > 0) {
        step_ns += batch_ns / BATCH_TICKS * source->uneven * (2 * uniform(trace) - 1);
    }
    if (source->pause_s > 0 && uniform(trace) < PAUSE_CHANCE) {
        step_ns += source->pause_s * 1e9 * uniform(trace);
    }
    if (source->restart_s > 0 && trace->true_ns - trace->begun_ns > source->restart_s * 1e9) {
        step_ns += AWAY_NS;
        trace->begun_ns = trace->true_ns + step_ns;
        trace->cycles = BATCH_CYCLES;
    }
    return step_ns;
}

/* A start of frame comes every 125 us of the controller's clock. */
static void date(struct clock_trace *trace, double step_ns, struct clock_arrival *arrival)
{
    if (trace->usb_wander > 0) {
        trace->usb_skew += trace->usb_wander * (uniform(trace) - 0.5);
    }
    trace->usb_ns += step_ns * (1 + trace->usb_skew);
    const double microframe = floor(trace->usb_ns / MICROFRAME_NS);
    arrival->usb_time = (uint16_t)(USB_TIME_KNOWN | ((int64_t)microframe % MICROFRAMES));
    arrival->sof_cycles = (uint16_t)((trace->usb_ns - microframe * MICROFRAME_NS) * (TRACE_CLOCK_HZ / 1e9));
}

struct clock_arrival clock_trace_next(struct clock_trace *trace)
{
    struct clock_arrival arrival;
    const double step_ns = step(trace);
    trace->true_ns += step_ns;
    date(trace, step_ns, &arrival);
    const double ready_ns = trace->true_ns + TRACE_LATENCY_NS + LEAST_NS;
    if (uniform(trace) < STALL_CHANCE) {
        trace->busy_until_ns = ready_ns + STALL_NS * uniform(trace);
    }
    const double late_ns = -USUAL_NS * log(uniform(trace));
    trace->last_ns = fmax(fmax(ready_ns, trace->busy_until_ns) + late_ns, trace->last_ns + ORDER_NS);
    arrival.cycles = (uint64_t)trace->cycles;
    arrival.true_ns = trace->true_ns;
    arrival.arrival_ns = (int64_t)trace->last_ns;
    return arrival;
}
