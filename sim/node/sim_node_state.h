/* What sim_node.c and sim_node_lab.c share. */
#ifndef SIM_NODE_STATE_H
#define SIM_NODE_STATE_H

#include "dspic.h"
#include "port.h" // struct board
#include "sim_node_lab.h"

struct sim_node {
    struct dspic *chip;
    struct board board;
    struct mlx90333 sensor;
    struct sim_node_parameters parameters;
    uint64_t tick_fs; /* start of the present tick */
    bool powered;
    bool deaf;                   /* in this tick the CPU stands still: it erases or writes flash */
    unsigned bits;               /* clocked in this tick */
    bool second;                 /* in its second window */
    enum sim_sensor_fault fault; /* of the next reading */
    unsigned argument;
    uint32_t releases; /* breaches of t4 by the firmware; a reset's own are nobody's fault */
    uint64_t line;     /* of the sensor, as its master sampled it: the newest 64 bits */
    uint64_t frame;    /* the same when a frame had last ended */
    void (*act)(void *context);
    void *act_context;
    uint64_t armed_fs; /* when the link last got a record */
};

#endif
