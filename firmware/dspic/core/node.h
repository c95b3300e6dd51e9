/* The whisker node: a reading per SYNC, its record to the bridge after the next one.
 *
 * A port delivers the events below, one at a time: on the chip their interrupts share one priority.
 *
 *   SYNC n        record n-1 is armed on the link, reading n begins
 *   order n       the bridge says that this tick is n
 *   last byte     record n is packed
 *   SYNC n+1      record n is armed ...
 *
 * Until the reading ends, record n says LATE (or STARTING, RESYNC): at any moment the record to come is complete, and
 * SYNC does no more than start the sensor and hand over a pointer. */
#ifndef NODE_H
#define NODE_H

#include <stdbool.h>
#include <stdint.h>

#include "record.h"  // LINK_WORDS
#include "sampler.h" // struct sampler

struct node {
    struct board *board;
    struct sampler sampler;
    struct sensor_reading reading;   /* of the present tick, as far as it is known */
    uint8_t tick;                    /* low 8 bits of the present tick's number */
    uint8_t armed;                   /* which of the records the link has */
    uint16_t records[2][LINK_WORDS]; /* the one the link has, the one to come */
};

/* Call once, at reset; the sensor then needs about 18 ms. */
void node_start(struct node *node, struct board *board);

/* True if a SYNC now would start a reading. */
bool node_ready(const struct node *node);

/* Rising edge of SYNC. */
void node_on_sync(struct node *node);

/* End of what board_timer_start() began. */
void node_on_timer(struct node *node);

/* End of what board_sensor_transfer() began: the byte received. */
void node_on_sensor_byte(struct node *node, uint8_t byte);

/* The bridge has clocked a whole transfer: the words received. With a wrong CRC the tick's number stays the one
 * counted from SYNC to SYNC. */
void node_on_order(struct node *node, const uint16_t words[LINK_WORDS]);

#endif
