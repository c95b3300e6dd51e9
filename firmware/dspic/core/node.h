/* The whisker node: a reading per SYNC, its record to the bridge after the next one.
 *
 * A port delivers the events below, one at a time: on the chip their interrupts share one priority.
 *
 *   SYNC n        reading n begins; the link holds record n-1
 *   order n       the bridge has clocked out record n-1 and says that this tick is n
 *                 the link gets a record n that says LATE (or STARTING, RESYNC)
 *   last byte     the link gets record n
 *   SYNC n+1      reading n+1 begins ...
 *
 * A tick whose order says so has a second window, with a service order (service.h); the record waits for its end:
 *
 *   order n       the link gets the answer to the service order before
 *   window's end  the link gets record n as far as it is known
 *
 * An order that comes too long after the last SYNC is not of the same tick: that SYNC was a stray one or the tick's own
 * was lost. What is read meanwhile says LATE, until an order comes in time.
 *
 * The link is armed well before the SYNC after which it is clocked: the bridge selects sooner after SYNC than an
 * interrupt could load the first word. */
#ifndef NODE_H
#define NODE_H

#include <stdbool.h>
#include <stdint.h>

#include "record.h"  // LINK_WORDS
#include "sampler.h" // struct sampler
#include "service.h" // struct service

/* From SYNC to the end of its order, in microseconds: with the bridge's slowest settings (SCK divider 32, word gap 255)
 * 4 gaps, 64 bits and 9 cycles at 60 MHz make 51.3; the rest is the interrupts' latency and an oscillator 4 % fast. */
#define NODE_ORDER_MOST_US 70u

struct node {
    struct board *board;
    struct sampler sampler;
    struct sensor_reading reading;   /* of the present tick, as far as it is known */
    uint8_t tick;                    /* low 8 bits of the present tick's number */
    bool numbered;                   /* the order that belongs to the last SYNC has come */
    bool ordered;                    /* an order has come in the present transfer */
    bool displaced;                  /* the newest order came too long after SYNC: that SYNC was another tick's */
    bool begun;                      /* there was a SYNC since the start */
    bool serving;                    /* the link waits for this tick's second window, not for the next record */
    uint8_t armed;                   /* which of the records the link has */
    uint16_t records[2][LINK_WORDS]; /* one is clocked out while the other is packed */
    struct service service;
    uint16_t health[WHISKER_HEALTH_COUNT];
};

/* Call once, at reset; the sensor then needs about 18 ms. `code`: what the records say meanwhile, WHISKER_CODE_STARTING
 * or the kind of reset, WHISKER_CODE_RESET_*. */
void node_start(struct node *node, struct board *board, uint8_t code);

/* In place of node_start, for the loader: it leaves the sensor alone, and its records say WHISKER_CODE_LOADER. */
void node_start_loader(struct node *node, struct board *board);

/* Answers the service order that waits, if it asks for a counter. False: it is for others to answer, or not whole.
 * Called in the main loop. */
bool node_tell_health(struct node *node);

/* A word came that the link could not take. */
void node_on_link_overflow(struct node *node);

/* The bridge has clocked the second window of a tick: the words received. */
void node_on_service(struct node *node, const uint16_t words[SERVICE_WORDS]);

/* True if a SYNC now would start a reading. */
bool node_ready(const struct node *node);

/* Rising edge of SYNC. */
void node_on_sync(struct node *node);

/* End of what board_timer_start() began. */
void node_on_timer(struct node *node);

/* End of what board_sensor_transfer() began: the byte received. */
void node_on_sensor_byte(struct node *node, uint8_t byte);

/* A byte of the sensor was lost within the node. */
void node_on_sensor_overrun(struct node *node);

/* The bridge has ended a transfer, whole (then node_on_order() came first) or not. */
void node_on_transfer_end(struct node *node);

/* The bridge has clocked a whole transfer: the words received. With a wrong CRC the tick's number stays the one
 * counted from SYNC to SYNC. A second order after one SYNC changes nothing: if that SYNC was missed, there is no
 * reading to go by the new number, and the old record, sent again, tells the bridge so. */
void node_on_order(struct node *node, const uint16_t words[LINK_WORDS]);

#endif
