/* What the files sim_node*.c share. */
#ifndef SIM_NODE_STATE_H
#define SIM_NODE_STATE_H

#include "dspic.h"
#include "port.h" // struct board
#include "sim_node_lab.h"

#define SIM_NODE_TICK_FS (SIM_TICK_NS * DSPIC_FS_PER_NS)
enum { LINK_BITS = LINK_WORDS * 16 };

/* What has come from the bridge in the present tick. */
enum sim_node_step {
    SIM_NODE_ASLEEP, /* no SYNC yet */
    SIM_NODE_SYNCED,
    SIM_NODE_SELECTED,
    SIM_NODE_ENDED, /* a whole transfer */
    SIM_NODE_ODD,   /* anything else */
};
struct sim_node_tick {
    struct sim_field field;
    uint64_t order; /* bits of MOSI so far, the newest one lowest */
    uint8_t bits;   /* clocked */
    bool high;      /* level of SCK */
    enum sim_node_step step;
};

/* What a tick begins with and leaves to the next one, but for time. */
struct sim_node_state_of_tick {
    struct sampler sampler;
    struct sensor_reading reading;
    uint8_t tick;
    struct mlx90333_sense sense;
};

/* Ticks at record level (sim_node_record.c): to it if nothing stands against it, at the end of a tick; and back, at
 * once. What comes meanwhile: false: it has been left, and the caller goes on with the registers. */
struct sim_node_level {
    void (*enter)(struct sim_node *node);
    void (*leave)(struct sim_node *node);
    bool (*sync)(struct sim_node *node, struct sim_field field);
    bool (*select)(struct sim_node *node, bool low);
    bool (*sck)(struct sim_node *node, bool level, bool mosi, bool *miso);
    bool (*run)(struct sim_node *node);
};
struct sim_node_quick {
    const struct sim_node_level *level; /* NULL: all ticks are run with the registers */
    bool on;
    bool differs;         /* the registers brought something else */
    unsigned until_check; /* ticks */
    uint64_t ticks;       /* since the chip stands */
    uint64_t latch_ns;    /* from SYNC until the sensor latches */
    uint64_t record;      /* for the next transfer, first bit highest */
    struct sim_node_tick last;
    struct sim_node_state_of_tick before, now; /* the last tick */
};

struct sim_node {
    struct dspic *chip;
    struct board board;
    struct mlx90333 sensor;
    struct mlx90333 twin; /* on the same wires, and spared every fault: it judges the master, and shows what was sent */
    bool apart;           /* else the sensor stands for its twin, which has nothing of its own but `random` */
    bool twin_stays;      /* the twin is always apart */
    struct sim_node_parameters parameters;
    uint64_t tick_fs; /* start of the present tick */
    bool powered;
    bool deaf;                   /* in this tick the CPU stands still: it erases or writes flash */
    unsigned bits;               /* clocked in this tick */
    bool second;                 /* in its second window */
    enum sim_sensor_fault fault; /* of the next reading */
    unsigned argument;
    uint32_t releases;    /* breaches of t4 by the firmware; a reset's own are nobody's fault */
    uint64_t line, clean; /* newest 64 bits of the sensor's line as its master sampled it, and of the twin's */
    struct sim_node_frame begun, frame; /* the frame under way, the one that has last ended */
    void (*act)(void *context);
    void *act_context;
    uint64_t armed_fs; /* when the link last got a record */
    uint64_t record;   /* that record, first bit highest */
    uint32_t arms;     /* how often it got one */
    struct sim_node_tick came;
    struct sim_node_quick quick;
};

/* sim_node_sensor.c: edges of /SS and of the clock. */
void sim_node_sensor_select(struct sim_node *node, bool level, uint64_t now_ns);
void sim_node_sensor_clock(struct sim_node *node, bool level, uint64_t now_ns);
void sim_node_sensor_end_frame(struct sim_node *node); /* the firmware has its last byte */

/* The first supply of all; both sensors with their supply or without; the sensor alone. */
void sim_node_sensor_power_on(struct sim_node *node);
void sim_node_sensor_supply(struct sim_node *node, bool on);
void sim_node_sensor_switch(struct sim_node *node, bool on);

/* The field from then on, for one sensor, and for sensor and twin. */
void sim_node_sensor_set_field(struct mlx90333 *sensor, uint64_t since_fs, struct sim_field field);
void sim_node_sensor_set_fields(struct sim_node *node, uint64_t since_fs, struct sim_field field);

/* From here on the twin is not what the sensor is. */
void sim_node_sensor_part(struct sim_node *node);

/* The master's breaches so far; those of t4 as an interrupt found them, and as before a reset within it. */
uint32_t sim_node_sensor_violations(const struct sim_node *node);
void sim_node_sensor_note_releases(struct sim_node *node);
void sim_node_sensor_forget_releases(struct sim_node *node);

/* Takes down what comes. */
void sim_node_note_select(struct sim_node_tick *came, bool low);
void sim_node_note_sck(struct sim_node_tick *came, bool level, bool mosi);

/* The rest of a tick with the chip's registers. */
void sim_node_run_registers(struct sim_node *node);

/* The flash as it comes from the first programming. */
void sim_node_program_default(struct sim_node *node);

#endif
