/* Angles of a field as the MLX90333 gives them: count 0x8000 along the third axis, 65536 counts for 180 degrees. */
#ifndef ANGLE_H
#define ANGLE_H

#include <stdint.h>

/* A field, in any unit: 32767 is the sensor's full range. */
struct field {
    int32_t x, y, z;
};

/* Angle of the field towards `side`, seen from `axis`: within a count of the exact one. A magnet turned around gives
 * the same: both components change their sign. */
uint16_t angle_of(int32_t side, int32_t axis);

/* Square of the field's strength. */
uint32_t angle_strength(const struct field *field);

#endif
