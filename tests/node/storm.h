/* Random faults, one schedule after another, on nodes of random parts; the world's log of what it broke is held against
 * what the record stream flagged. */
#ifndef STORM_H
#define STORM_H

#include <stdint.h>

/* What can break. Faults that sound frames hide (a frozen sensor) are left out: nothing in-band can show them. */
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

/* Frames of the sensor that were hurt: by the first kinds above, or as what a lost or doubled clock leaves behind. */
enum storm_line {
    STORM_LINE_FLIP_BIT,
    STORM_LINE_FLIP_TWO,
    STORM_LINE_NOISY,
    STORM_LINE_FLOATING,
    STORM_LINE_DEAD,
    STORM_LINE_STUCK_LOW,
    STORM_LINE_ERROR_BITS,
    STORM_LINE_LOST_CLOCK,
    STORM_LINE_EXTRA_CLOCK,
    STORM_LINE_BEHIND, /* the sensor began one bit late */
    STORM_LINE_AHEAD,  /* one bit early */
    STORM_LINE_OTHER   /* supplies, resets, more than one of these */
};

struct storm_counts {
    uint64_t schedules, ticks, bad; /* bad: records not good */
    uint64_t
        missed_line; /* good, though hurt on the sensor's line: the bytes that came pass every check by arithmetic */
    uint64_t missed_link; /* good, though hurt on the link: likewise */
    uint64_t displaced; /* sound, but read up to 49 us before its tick, at a stray SYNC; its tick's own did not come */
    uint64_t unexplained; /* good, hurt or altered otherwise: a check should have reported */
    uint64_t unforeseen;  /* bits hurt otherwise than what was broken hurts them: the log itself would be wrong */
    uint64_t spurious;    /* bad without a fault */
    uint64_t stuck;       /* not good again within STORM_PATIENCE ticks: the batch ends */
    uint64_t violations;  /* of the sensor's or the chip's data sheet */
    uint64_t overwritten; /* words that arming displaced amid a transfer at a wrong time; any others are violations */
};

enum { STORM_PATIENCE = 700 };

/* Batch `seed`: the same counts each time. */
struct storm_counts storm_batch(uint64_t seed);

#endif
