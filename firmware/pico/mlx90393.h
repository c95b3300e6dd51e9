/* MLX90393 by SPI mode 3: a command, then its status byte, then data; all axes by one trigger on its pin TRIG.
 *
 * Fastest settings: no oversampling, no filter. Three axes take 1.2 ms (data sheet: stand-by 0.22, each axis 0.26, end
 * 0.12 ms), 1.4 ms with the slowest oscillator: ticks of 2 ms, 500 Hz, always have a reading of their own; of shorter
 * ticks some are LATE. */
#ifndef MLX90393_H
#define MLX90393_H

#include <stdbool.h>

#include "sensor.h"

/* A step of finding and setting up the chip of a lane. False: this is not such a chip. */
bool mlx90393_step(struct sensor *sensor, uint8_t lane);

void mlx90393_read(struct sensor *sensor, uint8_t lane, struct sensor_result *result);

#endif
