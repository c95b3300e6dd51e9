/* MLX90333 on its serial pins, edge by edge: a slave in SPI mode 1 on one shared open-drain data line.
 *
 * The line is low if either side pulls it low, so master and sensor are a wired AND. The sensor ignores everything
 * until its start-up time has passed, and keeps its count of bits and bytes for ever unless /SS, high long enough,
 * resynchronises it. It also watches its master: every breach of the data sheet is counted, and tests demand zero.
 * What a part may be like is in mlx90333_parameters.h; what it measures in mlx90333_sense.h. */
#ifndef MLX90333_MODEL_H
#define MLX90333_MODEL_H

#include <stdbool.h>
#include <stdint.h>

#include "mlx90333_datasheet.h" // times: firmware/dspic/core
#include "mlx90333_sense.h"     // struct mlx90333_sense, struct mlx90333_field
#include "sim_counts.h"         // sim_counts

enum sim_sensor_fault {
    SIM_SENSOR_GOOD,
    SIM_SENSOR_FLIP_BIT,    /* one bit is inverted at the master's end; argument 0 to 63 in order of sending */
    SIM_SENSOR_DEAD,        /* all ones: nothing drives the line */
    SIM_SENSOR_STUCK_LOW,   /* all zeros */
    SIM_SENSOR_ERROR_BITS,  /* a sound frame whose error word is the argument */
    SIM_SENSOR_FLOATING,    /* the line follows nobody: random levels */
    SIM_SENSOR_FROZEN,      /* sound frames, always the same angles */
    SIM_SENSOR_LOST_CLOCK,  /* one clock edge pair does not reach it; argument: which bit of the frame, 0 to 63 */
    SIM_SENSOR_FLIP_TWO,    /* two bits are inverted; argument: one position, and 256 times the other */
    SIM_SENSOR_NOISY,       /* each bit is inverted with the probability argument / 65536 */
    SIM_SENSOR_EXTRA_CLOCK, /* it sees one clock edge pair too many; argument: after which bit of the frame */
};

/* What a master may do wrong. */
enum mlx90333_violation {
    MLX90333_CLOCK_PERIOD,     /* t1 */
    MLX90333_BYTE_GAP,         /* t2 */
    MLX90333_SELECT_HIGH,      /* t4 */
    MLX90333_SELECT_LOW,       /* t6 */
    MLX90333_START_GAP,        /* t7 */
    MLX90333_ZERO_SENT,        /* a bit of the master's was not a one */
    MLX90333_CLOCK_IN_STARTUP, /* an edge before the sensor was awake */
    MLX90333_VIOLATIONS        /* how many kinds there are */
};

/* Kept by the caller; the fields are the model's own. Times are nanoseconds of virtual time and never go back. */
struct mlx90333 {
    uint32_t t1, t2, t4, t5, t6, t7; /* stretched by this part's oscillator */
    struct mlx90333_parameters parameters;
    struct mlx90333_sense sense;
    uint64_t latch_ns;         /* of the newest frame */
    uint64_t age_ns;           /* of its conversion then */
    uint64_t awake_ns;         /* when the start-up ends */
    uint64_t select_ns;        /* last edge of /SS */
    uint64_t rise_ns, fall_ns; /* last clock edges */
    uint64_t random;
    uint32_t violations[MLX90333_VIOLATIONS];
    uint16_t argument; /* of the fault */
    uint8_t fault;     /* enum sim_sensor_fault */
    bool select;       /* level of /SS */
    bool fresh;        /* no clock edge since /SS fell */
    bool enabled;      /* resynchronised since power-up */
    bool answering;    /* the start byte was right */
    bool level;        /* what the sensor's side lets through: false pulls the line low */
    uint8_t byte, bit; /* position in the frame */
    uint8_t sending;   /* bits still to send of this byte, next one on top */
    uint8_t received;  /* of the master's byte */
    bool reset_due;    /* after the present frame, which has errors */
    bool restarting;   /* has had such a reset */
    bool dropping;     /* a clock whose rising edge was lost loses its falling edge too */
    bool dark;         /* without supply */
    bool slipped; /* has counted other clocks than its master sent: what seems too soon is not the master's doing */
    uint8_t frame[MLX90333_FRAME_BYTES];
};

/* Supply on at `now_ns` with /SS high. */
void mlx90333_power_on(struct mlx90333 *sensor, uint64_t now_ns, const struct mlx90333_parameters *parameters);

/* The supply fails, or comes back and the start-up begins; the master is not informed, so nothing that it does before
 * the sensor is awake again counts against it. */
void mlx90333_supply(struct mlx90333 *sensor, uint64_t now_ns, bool on);

/* The field from `field->since_ns` on. */
void mlx90333_set_field(struct mlx90333 *sensor, const struct mlx90333_field *field);

/* The fault from now on, with its argument. */
void mlx90333_set_fault(struct mlx90333 *sensor, enum sim_sensor_fault fault, unsigned argument);

/* Edge of /SS. After a rising edge the sensor resynchronises surely if /SS stays high for t5, with growing likelihood
 * before that, and never at once. */
void mlx90333_select(struct mlx90333 *sensor, uint64_t now_ns, bool level);

/* Edge of SCLK while the master lets the line go (`master` true) or pulls it low. Returns the line's level after it. */
bool mlx90333_clock(struct mlx90333 *sensor, uint64_t now_ns, bool level, bool master);

/* The frame that a master reads who keeps to the data sheet, latched at `latch_ns`: without wires, or their faults. */
const uint8_t *mlx90333_read(struct mlx90333 *sensor, uint64_t latch_ns);

/* Two sensors without a fault, on the same wires, do the same from now on, but for what chance decides: whether a short
 * pause of /SS resynchronises. They may have counted other violations. */
bool mlx90333_equal(const struct mlx90333 *a, const struct mlx90333 *b);

/* All violations of the master's so far. */
uint32_t mlx90333_violations(const struct mlx90333 *sensor);

#endif
