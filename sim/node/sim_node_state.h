/* What sim_node.c and sim_node_flash.c share. */
#ifndef SIM_NODE_STATE_H
#define SIM_NODE_STATE_H

#include "dspic.h"
#include "port.h" // struct board
#include "sim_node_lab.h"

struct sim_node {
    struct dspic *chip;
    struct board board;
    struct mlx90333 sensor;
    struct mlx90333 twin; /* on the same wires, and spared every fault: it judges the master, and shows what was sent */
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
};

/* The field from then on, for sensor and twin. */
void sim_node_set_field(struct sim_node *node, uint64_t since_fs, struct sim_field field);

/* The flash as it comes from the first programming. */
void sim_node_program_default(struct sim_node *node);

#endif
