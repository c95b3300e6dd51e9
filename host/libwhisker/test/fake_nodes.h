/* A bridge with 28 nodes behind the library's control channel, as a script has them: this test's own
 * whisker_device_poll, device_send_service and device_answers. Each poll is one tick. */
#ifndef WHISKER_TEST_FAKE_NODES_H
#define WHISKER_TEST_FAKE_NODES_H

#include <stdbool.h>
#include <stdint.h>

#include "whisker/service.h"

#define NEVER UINT16_MAX

struct fake_node {
    /* who it is */
    bool there;
    uint16_t chip, firmware, options, loader;
    uint8_t wire_version;
    uint32_t serial;
    uint16_t health[32];
    /* what happens to it */
    uint16_t erase_ticks;    /* it is silent for, at begin and at the first block of a page */
    uint16_t restart_ticks;  /* it is silent for, when it goes from one program to the other */
    uint16_t gone_at;        /* block at which it falls silent for good; NEVER */
    uint16_t cut_at;         /* block at which its supply fails for a moment; NEVER */
    uint16_t stuck_at;       /* block that it asks for and does not take; NEVER */
    uint16_t flash_fails_at; /* block that its flash does not hold; NEVER */
    bool damaged;            /* what its flash holds has another CRC than the image */
    unsigned misses_runs;    /* orders `run` that pass it by */
    bool stays;              /* ignores `enter` */
    unsigned stays_for;      /* windows, then it is gone; 0: it stays */
    unsigned lose_percent;   /* of the windows it does not hear */
    /* how it stands */
    uint16_t state; /* WHISKER_NODE_STATE_* */
    uint16_t next, loads;
    unsigned busy;
    uint32_t random;
    bool answering;
    uint8_t command;
    uint16_t alpha, beta;
};

struct fake_nodes {
    struct fake_node node[WHISKER_FRAME_LANES];
    bool ticks_stopped; /* windows never end */
    int send_error, answers_error, poll_error;
    unsigned fail_after; /* the errors above begin after so many orders */
    unsigned orders, ticks;
    unsigned count_of[8]; /* orders by command */
};
extern struct fake_nodes fakes;

/* The first `count` lanes have good nodes, serial numbers 1, 2, ... */
void fake_nodes_reset(int count);

#endif
