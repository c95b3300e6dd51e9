/* What this port keeps of the board; on the host it holds the register model as well. */
#ifndef CHIP_BOARD_H
#define CHIP_BOARD_H

#include "boot/loader.h" // struct loader
#include "node.h"        // struct node

#ifndef __dsPIC33F__
struct dspic;
#endif

struct board {
#ifndef __dsPIC33F__
    struct dspic *chip; /* the register model */
#endif
    uint16_t trapped;    /* survives a reset: what led to it was a trap */
    uint16_t asked;      /* survives a reset: the firmware itself asked for it, BOARD_ASKED_* */
    uint16_t link_words; /* that the link waits for */
    bool loading;        /* the loader runs, not the application */
    struct node node;
    struct loader loader;
};

#endif
