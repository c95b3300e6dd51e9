/* Every fault that is tried on a node on purpose, and what the bridge must then see. */
#ifndef FAULT_MATRIX_H
#define FAULT_MATRIX_H

#include "lane_bench.h"

/* The verdicts on consecutive records as letters: . good, e good frame with error bits, S starting, R resync, L late,
 * x sensor_sum, 0 sensor_start, a sensor_absent, j step, P reset_power, W reset_watchdog, T reset_trap, O overrun,
 * - absent, c link_crc, t link_tick. The first is that on the record which the broken tick brings: the record of the
 * tick before. The last is the last bad one. */

struct fault_case {
    const char *name;
    struct lane_faults faults;                        /* of each broken tick */
    unsigned ticks;                                   /* how many in a row; 0: one */
    enum sim_node_disturbance end;                    /* what ends it, with the first sound tick */
    void (*part)(struct sim_node_parameters *);       /* parts that are special */
    void (*then)(unsigned nth, struct lane_faults *); /* of each tick after the broken ones, the first is 1 */
    void (*field)(unsigned tick, struct sim_field *); /* a field that is special */
    const char *expected;                             /* the verdicts, as an extended regular expression */
    const char *counted;                              /* the node's counters, likewise; NULL: as often as reported */
    unsigned most;                                    /* ticks without a good record, at most */
    const char *remark;
    bool for_ever;     /* it has no end; good samples are not waited for */
    bool undetectable; /* by what a node can check; the remark says why */
    bool breaches;     /* the sensor is not the one that the firmware's times are made for */
};

/* Counters as letters, each with its number, in this order and without those at zero: C order_crc, M order_missing,
 * V service_crc, F link_overflow, and e S R L x 0 a j O P W T as above. */

extern const struct fault_case FAULT_CASES[];
extern const unsigned FAULT_CASE_COUNT;

enum { FAULT_FIRST_TICK = 6, FAULT_GOOD_RUN = 8, FAULT_TEXT = 96 };

struct fault_outcome {
    bool as_expected;
    char verdicts[FAULT_TEXT]; /* a run of n > 9 of one letter is written as the letter and n */
    int detected_after;        /* place of the first bad verdict, 1: that on the broken tick's own record; -1: none */
    unsigned lost;             /* ticks without a good record */
    char counted[FAULT_TEXT];  /* what the node counted, as in `counted` of the case */
    bool counted_as_expected;
    unsigned altered;    /* good records that held something else */
    uint32_t violations; /* of the sensor's and the chip's data sheets */
};

/* Runs one case on a node with such parts. */
struct fault_outcome fault_run(const struct fault_case *row, const struct sim_node_parameters *parts);

/* What a node counted, as text; and what it should have counted if `letters` are all that happened: each tick once, but
 * a reset once for all the ticks that report it. */
void fault_counted(const sim_node *node, char text[FAULT_TEXT]);
void fault_reported(const char *letters, char text[FAULT_TEXT]);

/* Parts number `n` of FAULT_PARTS: both prefetch depths, slow, nominal and quick oscillators. */
enum { FAULT_PARTS = 6 };
struct sim_node_parameters fault_parts(unsigned n);

#endif
