/* Reads one sensor frame per SYNC. A state machine: nothing waits, each event does a few instructions.
 *
 *   STARTING --18 ms--> RESYNC_HIGH --t5--> RESYNC_LOW --t6--> READY <----------------- good frame --+
 *                            ^                                   |                                   |
 *                            |                                  SYNC --> BYTE --byte--> GAP --t7--> BYTE ...
 *                            +----------- RELEASE <---- SYNC before the end (late), or bad frame ----+
 *
 * Frames follow each other without a resynchronisation (/SS stays low), else 2 kHz would not fit: only power-up, a bad
 * frame and a late one raise /SS for t5, which overlaps the next SYNC and so costs that tick.
 *
 * A frame that slipped by a bit passes its sum about one time in eight, for all its bytes are halved or doubled, and so
 * is their sum (docs/results/node_faults.md): an angle that jumps further than a whisker can move in a tick is not
 * believed, and the sensor resynchronised. */
#ifndef SAMPLER_H
#define SAMPLER_H

#include <stdbool.h>
#include <stdint.h>

#include "board/sensor.h" // struct board
#include "sensor_frame.h" // struct sensor_reading

/* In counts. 30 degrees in 0.5 ms: a whisker swinging by 30 degrees at 50 Hz makes 4.7. */
#define SAMPLER_STEP_MOST 0x2AAAu

enum sampler_state {
    SAMPLER_STARTING,    /* /SS high, the sensor ignores it */
    SAMPLER_RESYNC_HIGH, /* /SS high for t5 */
    SAMPLER_RESYNC_LOW,  /* /SS low, too early for a clock edge */
    SAMPLER_READY,       /* /SS low, waiting for SYNC */
    SAMPLER_BYTE,        /* a byte is being clocked */
    SAMPLER_GAP,         /* between two bytes */
    SAMPLER_RELEASE,     /* frame given up, /SS still low: t4 after the last edge */
    SAMPLER_OFF,         /* no reading is ever started */
};

struct sampler {
    struct board *board;
    uint8_t state;        /* enum sampler_state */
    uint8_t unready;      /* code of a tick whose SYNC finds the sensor not ready */
    uint8_t count;        /* bytes of the frame received */
    bool followed;        /* the next good frame has one right before it */
    uint16_t alpha, beta; /* of that frame */
    uint8_t frame[MLX90333_FRAME_BYTES];
};

/* Begins the start-up wait. Call once, at reset. `unready`: the code of ticks until the sensor is ready,
 * WHISKER_CODE_STARTING or the kind of reset. */
void sampler_start(struct sampler *sampler, struct board *board, uint8_t unready);

/* In place of sampler_start: the sensor is left alone, and every tick has this code. */
void sampler_off(struct sampler *sampler, struct board *board, uint8_t code);

/* SYNC: starts a reading if the sensor is ready. Returns the code this tick's record carries unless
 * sampler_on_byte() ends the reading before the next SYNC: LATE if one was started, else STARTING or RESYNC. */
uint8_t sampler_on_sync(struct sampler *sampler);

/* The board's timer has elapsed. True when this makes the sensor ready. */
bool sampler_on_timer(struct sampler *sampler);

/* The sensor's byte has arrived. True when it ends the frame, with `reading` set. */
bool sampler_on_byte(struct sampler *sampler, uint8_t byte, struct sensor_reading *reading);

/* A byte was lost on its way. True when this ends a frame, with `reading` set. */
bool sampler_on_overrun(struct sampler *sampler, struct sensor_reading *reading);

/* True if a SYNC now would start a reading. */
bool sampler_ready(const struct sampler *sampler);

#endif
