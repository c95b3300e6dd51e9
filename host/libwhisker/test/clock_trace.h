/* Arrivals of an imagined bridge whose every delay and drift is known: what a clock mapping can be judged by. */
#ifndef WHISKER_TEST_CLOCK_TRACE_H
#define WHISKER_TEST_CLOCK_TRACE_H

#include <stdint.h>

#define TRACE_CLOCK_HZ 60000000u
#define TRACE_LATENCY_NS 550000

/* One batch of frames: the last one's time by both clocks, and when it arrived. */
struct clock_arrival {
    uint64_t cycles;
    double true_ns; /* monotonic clock at `cycles` */
    int64_t arrival_ns;
};

struct clock_trace {
    uint64_t random;
    double skew;     /* of the bridge's crystal at 25 degrees */
    double wander;   /* random walk of it */
    double period_s; /* of the warming and cooling, 3e-6 in amplitude */
    double cycles, true_ns, busy_until_ns, last_ns;
};

void clock_trace_begin(struct clock_trace *trace, uint64_t seed);

/* The next arrival, 8 ms of the bridge's clock later. */
struct clock_arrival clock_trace_next(struct clock_trace *trace);

#endif
