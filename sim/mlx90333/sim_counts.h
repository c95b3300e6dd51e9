/* The MLX90333's transfer from field angle to count. */
#ifndef SIM_COUNTS_H
#define SIM_COUNTS_H

#include <stdint.h>

/* Count the sensor sends for a field `field_deg` degrees from rest (rest is 90 degrees on the sensor's own scale):
 * 65536 counts span 180 degrees, rest is 0x8000, in steps of 12 bits (16 counts, 0.044 degrees, the resolution the data
 * sheet quotes), nearest step, held at both ends. Noise-free; not a number is held at the lower end. */
uint16_t sim_counts(double field_deg);

#endif
