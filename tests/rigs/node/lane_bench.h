/* The bridge's end of one lane in C, edge by edge in time, and what may go wrong on the way: SYNC, select, SCK, MOSI
 * and MISO, the sensor's line, the chip. Judges records as fpga/bridge_rtl/lane_receiver.v and framer.v do, and knows
 * what each of them should have held. */
#ifndef LANE_BENCH_H
#define LANE_BENCH_H

#include "sim_node_lab.h"
#include "whisker_protocol.h"

/* The link's times. Defaults: SCK divider 16, word gap 180, tick period 30000, all in cycles of 60 MHz. */
struct lane_timing {
    uint64_t half_fs, gap_fs, setup_fs, hold_fs, period_fs;
};
struct lane_timing lane_timing_of(unsigned sck_divider, unsigned word_gap, unsigned tick_period);

enum { LANE_TICK_PERIOD = SIM_TICK_NS * (WHISKER_LIMIT_CLOCK_HZ / 1000000u) / 1000u }; /* cycles of 60 MHz */

/* The bits of the bridge's order of this tick, the first one highest. */
uint64_t lane_order(uint8_t tick);

/* One tick as the world breaks it; all zero: nothing is broken. */
struct lane_faults {
    bool no_sync, no_select, select_stays;
    int32_t shift_ns;        /* SYNC and transfer come so much later (negative: sooner, but not amid the tick before) */
    uint32_t second_sync_ns; /* another pulse so long after the first */
    int32_t extra_clocks;    /* after the 64; negative: missing */
    uint8_t glitch_bit;      /* select rises for a moment before this bit of the transfer, 1 to 63 */
    bool mosi_stuck, mosi_level, miso_stuck, miso_level;
    uint64_t mosi_flips, miso_flips; /* bit 63 is the first */
    enum sim_sensor_fault sensor;    /* of the reading that this SYNC starts; a pending soft fault ends */
    unsigned sensor_argument;
    enum sim_node_disturbance disturbance;
    unsigned disturbance_argument;
    uint32_t disturbance_ns; /* after this tick's SYNC */
};

/* What the bridge makes of a record. Codes as in the protocol: the node's own, or ABSENT, LINK_CRC, LINK_TICK. */
struct lane_verdict {
    uint8_t code;
    uint16_t status; /* of an accepted record: error bits and code */
    uint16_t alpha, beta;
    bool good;            /* accepted, status zero: the host uses it */
    bool altered;         /* good, and yet not what the field was at that tick's SYNC */
    uint64_t sync_fs;     /* of the record's tick, were it on time */
    uint64_t armed, read; /* the record's bits as the link had them when the transfer began, and as they came */
    bool rearmed;         /* the node armed its link amid this transfer, or amid the one before and not since */
    bool overlapped;      /* amid this one, to its very end */
    struct sim_node_report report; /* of the node at the SYNC after */
};

/* Something done to the node at a time. */
struct lane_event {
    uint64_t at_fs;
    uint8_t what; /* of lane_bench.c's own list */
    bool level, mosi;
};
enum { LANE_EVENTS = 512 };

/* Who decides what happens and hears what came of it. */
struct lane_world {
    void *context;
    /* Field and faults of tick `tick`, which come zeroed; false: no more ticks. */
    bool (*plan)(void *context, unsigned tick, struct sim_field *field, struct lane_faults *faults);
    /* The verdict on the record that tick `tick` brought, which is that of the tick before. */
    void (*judged)(void *context, unsigned tick, const struct lane_verdict *verdict);
};

/* The fields are the bench's own. */
struct lane_bench {
    sim_node *node;
    struct lane_timing timing;
    struct lane_world world;
    bool ended;
    uint64_t next_fs;           /* the next tick's SYNC, were it on time */
    unsigned tick;              /* the present one */
    struct sim_field fields[2]; /* of the ticks with an even and an odd number */
    struct lane_faults faults;
    struct sim_node_report report; /* at this tick's SYNC */
    uint64_t record;               /* bits of it as the bridge read them */
    unsigned read;                 /* how many */
    struct sim_node_report first;  /* when the transfer began */
    bool stale;                    /* it was armed amid the transfer before, and not since */
    uint32_t arms, arms_at_end;    /* of the link: when the last was read, and when the transfer ended */
    struct lane_event events[LANE_EVENTS];
    unsigned planned, done;
};

/* Takes a node that is powered on and ready; the first tick, number 0, follows after a moment. The bench then stays in
 * place. */
void lane_bench_start(struct lane_bench *bench, sim_node *node, struct lane_timing timing);

/* Ticks until the world has no more; then more of them may follow, numbered on. */
void lane_bench_run(struct lane_bench *bench, const struct lane_world *world);

#endif
