/* The whisker node on the test bench: parts as they may be, pins at times of one's own, things that break.
 *
 * Mixes with sim_node.h: sim_node_run() ends at the next multiple of SIM_TICK_NS from the end of sim_node_power_on().
 */
#ifndef SIM_NODE_LAB_H
#define SIM_NODE_LAB_H

#include "dspic.h" // struct dspic_parameters
#include "sim_node.h"

struct sim_node_parameters {
    struct dspic_parameters chip;
    struct mlx90333_parameters sensor;
};

/* What sim_node_new(seed) uses. */
void sim_node_parameters_default(struct sim_node_parameters *parameters, uint64_t seed);

/* Makes a node as sim_node_new does. */
sim_node *sim_node_new_as(const struct sim_node_parameters *parameters);

enum sim_node_pin { SIM_NODE_SYNC, SIM_NODE_SELECT, SIM_NODE_SCK, SIM_NODE_MOSI };

/* Femtoseconds since the node was made; they never go back. A time before the present one means now. */
uint64_t sim_node_fs(const sim_node *node);
void sim_node_until(sim_node *node, uint64_t at_fs);
void sim_node_pin(sim_node *node, enum sim_node_pin pin, bool level, uint64_t at_fs);
bool sim_node_miso(const sim_node *node); /* true (pulled up) when nothing drives it */

/* `act` is called at the times planned, exactly, whatever the firmware is doing; there sim_node_pin() (for now),
 * sim_node_plan(), sim_node_field(), sim_node_sensor_fault() and, last, sim_node_disturb() may be called. */
void sim_node_outside(sim_node *node, void (*act)(void *context), void *context);
void sim_node_plan(sim_node *node, uint64_t at_fs);

/* The field and the sensor's fault from now on. */
void sim_node_field(sim_node *node, struct sim_field field);
void sim_node_sensor_fault(sim_node *node, enum sim_sensor_fault fault, unsigned argument);

/* From now on the fault-free twin of the sensor is always there: the way that the quicker one is held against. */
void sim_node_keep_twin(sim_node *node);

/* What may befall the chip and the supplies, at the present time. */
enum sim_node_disturbance {
    SIM_NODE_NOTHING,
    SIM_NODE_TRAP,       /* argument: enum dspic_trap */
    SIM_NODE_RESET,      /* argument: RCON_* */
    SIM_NODE_HANG,       /* the firmware stands still */
    SIM_NODE_COLLISION,  /* of DMA; argument: the channel, and 256 if in the peripheral */
    SIM_NODE_UNREAD,     /* argument: SPI 1 or 2, whose next word overflows */
    SIM_NODE_DARK,       /* chip and sensor without supply */
    SIM_NODE_LIGHT,      /* and again with it; what the RAM held is gone */
    SIM_NODE_SENSOR_OFF, /* the sensor alone */
    SIM_NODE_SENSOR_ON,
};
void sim_node_disturb(sim_node *node, enum sim_node_disturbance what, unsigned argument);

/* A whole frame of the sensor. */
struct sim_node_frame {
    uint64_t line;   /* the last 64 bits that the chip sampled, last one lowest */
    uint64_t sent;   /* what they were without any fault of sensor, wires or clock */
    uint32_t number; /* frames so far */
    uint64_t begun_fs;
    uint8_t slip;  /* bits by which the sensor's count was ahead of the chip's when it began, modulo 64 */
    bool followed; /* the firmware knew the angles before it: these */
    uint16_t alpha_before, beta_before;
};

/* What happened within. Times in femtoseconds. */
struct sim_node_report {
    struct sim_node_frame frame; /* the newest */
    uint64_t record;             /* the record that the link got last, first bit highest */
    uint32_t arms;               /* how often it got one */
    uint64_t latch_fs;           /* of the sensor's newest frame: when its angles became those that are sent */
    uint64_t age_fs;             /* how old they were then */
    uint64_t armed_fs;           /* when the link last got a record */
    uint64_t busy_fs;            /* spent in interrupts */
    uint64_t interrupts;
    uint32_t fcy_hz;
    uint32_t overwritten; /* words of an SPI module that another took the place of; also among the violations */
};
struct sim_node_report sim_node_report(const sim_node *node);

/* What the node has counted since its last reset; `counter`: WHISKER_HEALTH_*. */
uint16_t sim_node_counted(const sim_node *node, unsigned counter);

#endif
