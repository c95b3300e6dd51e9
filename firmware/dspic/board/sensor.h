/* Board contract: SPI master in mode 1 towards the sensor. Nothing here waits; a byte's end is an event. */
#ifndef BOARD_SENSOR_H
#define BOARD_SENSOR_H

#include <stdbool.h>
#include <stdint.h>

struct board; /* the port's own state */

#define BOARD_SENSOR_BYTE_MAX_US 24u /* eight bits at FCY/112, slowest clock and interrupt latency included */

/* Level of the sensor's /SS pin: false selects it. High from reset. */
void board_sensor_select(struct board *board, bool level);

/* Starts clocking one byte; node_on_sensor_byte() follows once, at most BOARD_SENSOR_BYTE_MAX_US later.
 * Not to be called again before that. */
void board_sensor_transfer(struct board *board, uint8_t byte);

#endif
