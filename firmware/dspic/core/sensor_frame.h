/* Decoder of the sensor's frame: pure, no state. */
#ifndef SENSOR_FRAME_H
#define SENSOR_FRAME_H

#include <stdint.h>

#include "mlx90333_datasheet.h" // MLX90333_FRAME_BYTES
#include "whisker_protocol.h"   // WHISKER_STATUS_CODE_SHIFT

/* One reading of the sensor as a record carries it. */
struct sensor_reading {
    uint16_t alpha;  /* count; 0x8000 at rest; zero unless the code is OK */
    uint16_t beta;   /* count; likewise */
    uint16_t status; /* WHISKER_CODE_* << WHISKER_STATUS_CODE_SHIFT | WHISKER_ERROR_* */
};

/* A reading that holds nothing but a code, WHISKER_CODE_*. */
static inline struct sensor_reading sensor_reading_of_code(uint8_t code)
{
    const struct sensor_reading reading = {0, 0, (uint16_t)((uint16_t)code << WHISKER_STATUS_CODE_SHIFT)};
    return reading;
}

/* Reading in a frame.
 *
 * All ones is a sensor that does not answer, a wrong first byte a line stuck low (all zeros has the right sum: both
 * checks are needed). The sum covers bytes 1 to 6. Whether the error word is part of it is not confirmed, so with
 * errors set a sum over bytes 1 to 4 passes too. A bit that is not assigned is a flipped one: no frame with such a bit
 * passes, else it and a flip in the data could make up for each other. */
struct sensor_reading sensor_frame_decode(const uint8_t frame[MLX90333_FRAME_BYTES]);

/* The assigned bits of the sensor's 16-bit error word as WHISKER_ERROR_* bits 9..0. */
uint16_t sensor_frame_errors(uint16_t word);

#endif
