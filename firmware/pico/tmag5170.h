/* TMAG5170: frames of 32 bits by SPI mode 0, each with four bits of CRC; started by its pin ALERT.
 *
 * A frame of two axes (12 bits each) is read while the frame's write chooses the next pair: X and Y, then Z and Y. Data
 * sheet, the maker's own code and users differ in where the nibbles of such a frame are and in its CRC: each layout is
 * tried at the start against plain reads of the same conversion, and if none fits, plain reads of 16 bits remain. */
#ifndef TMAG5170_H
#define TMAG5170_H

#include <stdbool.h>

#include "sensor.h"

#define TMAG5170_SETS_NONE UINT8_MAX /* sensor.sets: the next reading's conversion is new, whatever its number */

/* Makes the tables; once. */
void tmag5170_start(void);

/* A step of finding and setting up the chip of a lane; a few frames. False: this is not such a chip. */
bool tmag5170_step(struct sensor *sensor, uint8_t lane);

/* Reads a lane of each bus at once; both are ready and laid out alike, or one is BOARD_LANE_NONE. While bits are under
 * way it calls `meanwhile`, first with false: then tmag5170_take() is due, for what was read before; then with true. */
void tmag5170_read(struct sensor *sensors, const uint8_t lanes[BOARD_BUSES], void (*meanwhile)(bool taken));

/* What the latest reading gave. */
void tmag5170_take(struct sensor *sensors, struct sensor_result *results);

/* Chooses the first pair of axes anew. */
void tmag5170_again(const struct sensor *sensor, uint8_t lane);

#endif
