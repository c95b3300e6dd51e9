/* The lanes: finds their sensors, reads them, makes readings of fields. A tick at a time, in the reading's interrupt.
 */
#ifndef LANES_H
#define LANES_H

#include <stdbool.h>
#include <stdint.h>

#include "board.h"        // BOARD_LANES
#include "sensor_frame.h" // struct sensor_reading

/* `code`: what lanes say until their sensors are found, WHISKER_CODE_STARTING or the kind of reset. */
void lanes_start(uint8_t code);

/* A step of finding the sensor of one lane that has none, then a reading of each of the lanes in `mask`. */
void lanes_read(uint32_t mask, struct sensor_reading readings[BOARD_LANES]);

/* Is there a reading only late in a tick? One of the sensors is of the slow kind. */
bool lanes_are_slow(void);

/* Had every lane of the latest reading its sensor? */
bool lanes_ready(void);

/* A counter of a lane's health, WHISKER_HEALTH_*. */
uint16_t lanes_health(uint32_t lane, uint32_t counter);

/* Does a sensor answer on this lane? */
bool lanes_present(uint32_t lane);

#endif
