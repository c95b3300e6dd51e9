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
    uint16_t usb_time, sof_cycles; /* of its frame and the report `timing` */
};

/* What makes the ticks, if not the bridge's even divider. */
struct clock_source {
    double off;       /* their period is so much longer than the one set */
    double uneven;    /* each of 16 comes up to so much of a period early or late */
    double pause_s;   /* now and then there is none for up to so long */
    double restart_s; /* the bridge is started again after so long */
};

struct clock_trace {
    uint64_t random;
    double skew;                 /* of the bridge's crystal at 25 degrees */
    double wander;               /* random walk of it */
    double period_s;             /* of the warming and cooling, 3e-6 in amplitude */
    double usb_skew, usb_wander; /* of the USB controller's crystal, from the host's */
    double cycles, true_ns, usb_ns, busy_until_ns, last_ns;
    double begun_ns; /* the bridge, by true_ns */
    struct clock_source source;
};

void clock_trace_begin(struct clock_trace *trace, uint64_t seed);

/* The next arrival, 8 ms of the bridge's clock later. */
struct clock_arrival clock_trace_next(struct clock_trace *trace);

#endif
