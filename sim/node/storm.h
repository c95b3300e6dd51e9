/* Random faults, one schedule after another, on nodes of random parts; the world's log of what it broke is held against
 * what the record stream flagged. */
#ifndef STORM_H
#define STORM_H

#include <stdint.h>

/* What can break. Faults that sound frames hide (a frozen sensor) are left out: nothing in-band can tell them. */
#define STORM_KINDS(X)                                                                                                 \
    X(FLIP_BIT, 60)                                                                                                    \
    X(FLIP_TWO, 60)                                                                                                    \
    X(NOISY, 60)                                                                                                       \
    X(FLOATING, 60)                                                                                                    \
    X(DEAD, 30)                                                                                                        \
    X(STUCK_LOW, 30)                                                                                                   \
    X(ERROR_BITS, 40)                                                                                                  \
    X(LOST_CLOCK, 60)                                                                                                  \
    X(EXTRA_CLOCK, 60)                                                                                                 \
    X(NO_SYNC, 40)                                                                                                     \
    X(SECOND_SYNC, 60)                                                                                                 \
    X(SHIFT, 60)                                                                                                       \
    X(MOSI_FLIPS, 40)                                                                                                  \
    X(MISO_FLIPS, 60)                                                                                                  \
    X(CLOCKS, 60)                                                                                                      \
    X(NO_SELECT, 30)                                                                                                   \
    X(SELECT_STAYS, 30)                                                                                                \
    X(GLITCH, 40)                                                                                                      \
    X(MISO_STUCK, 20)                                                                                                  \
    X(MOSI_STUCK, 20) X(UNREAD, 30) X(RESET, 4) X(TRAP, 4) X(COLLISION, 4) X(HANG, 1) X(SENSOR_OFF, 4) X(DARK, 4)

#define STORM_NAME(name, weight) STORM_##name,
enum storm_kind { STORM_KINDS(STORM_NAME) STORM_KIND_COUNT };
#undef STORM_NAME

enum { STORM_SCHEDULES = 1000 }; /* of a batch, all on one node */

struct storm_kind_counts {
    uint64_t injected;
    uint64_t altered; /* good records that held something else, put down to this kind */
};

struct storm_counts {
    uint64_t schedules, ticks, bad; /* bad: records not good */
    uint64_t missed_line;           /* altered, but what came down the sensor's line passes every check */
    uint64_t missed_link;           /* altered: bits were hurt on the link, and the record's CRC and tick fit them */
    uint64_t unexplained;           /* altered otherwise: a check should have told */
    uint64_t spurious;              /* bad without a fault */
    uint64_t stuck;                 /* not good again within STORM_PATIENCE ticks: the batch ends */
    uint64_t violations;            /* of the sensor's or the chip's data sheet */
    struct storm_kind_counts kinds[STORM_KIND_COUNT];
};

enum { STORM_PATIENCE = 700 };

const char *storm_kind_name(enum storm_kind kind);

/* Batch `seed`: the same counts each time. */
struct storm_counts storm_batch(uint64_t seed);

#endif
