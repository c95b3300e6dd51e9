/* What the two kinds of sensors have in common: how a lane's chip is found and set up, a step a tick, and read. */
#ifndef SENSOR_H
#define SENSOR_H

#include <stdint.h>

#include "angle.h" // struct field
#include "board.h" // BOARD_LANES

enum sensor_kind { SENSOR_NONE, SENSOR_TMAG5170, SENSOR_MLX90393 };

struct sensor {
    uint8_t kind;   /* SENSOR_NONE until it is ready */
    uint8_t tried;  /* the kind that is being looked for */
    uint8_t start;  /* WHISKER_CODE_* of a tick while a chip is set up */
    uint8_t code;   /* . while none is found; WHISKER_CODE_OK: one is */
    uint8_t step;   /* of its set-up */
    uint8_t layout; /* TMAG5170: how its frames of two axes are laid out */
    uint8_t sets;   /* TMAG5170: number of the latest conversion; MLX90393: ticks of waiting */
    uint8_t tries;
    uint16_t bad; /* readings that failed in a row */
};

/* What one reading gave: a field, or a code other than WHISKER_CODE_OK. */
struct sensor_result {
    struct field field;
    uint8_t code;
};

#endif
