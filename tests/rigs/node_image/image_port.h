/* The image in place of the firmware's C: sim_node.c calls it as it calls port_dspic. What it has cost so far.
 *
 * The environment names the table of the image (translate.py), NODE_IMAGE, and a file that gets the costs as JSON at
 * the program's end, NODE_IMAGE_COSTS. */
#ifndef IMAGE_PORT_H
#define IMAGE_PORT_H

#include <stdbool.h>
#include <stdint.h>

#include "image_table.h"

enum { IMAGE_VECTORS = 126 }; /* 8 traps, 118 interrupts */

/* What an interrupt is for, by what the node was about. */
#define IMAGE_HANDLERS(X)                                                                                              \
    X(SYNC)             /* INT1 */                                                                                     \
    X(BYTE)             /* SPI1, but for the frame's last byte */                                                      \
    X(LAST_BYTE)        /* SPI1: the record */                                                                         \
    X(GAP)              /* T2: the next byte */                                                                        \
    X(RAISE)            /* T2: /SS up */                                                                               \
    X(LOWER)            /* T2: /SS down */                                                                             \
    X(READY)            /* T2: also at the end of the start-up */                                                      \
    X(ORDER)            /* DMA1 */                                                                                     \
    X(SERVICE)          /* DMA1: a service order */                                                                    \
    X(SELECT_UP)        /* INT2 after a whole transfer */                                                              \
    X(SELECT_UP_BROKEN) /* INT2 after another */                                                                       \
    X(SENSOR_OVERRUN)   /* SPI1's error */                                                                             \
    X(LINK_OVERFLOW)    /* SPI2's error */                                                                             \
    X(OTHER)

#define IMAGE_HANDLER(name) IMAGE_##name,
enum image_handler { IMAGE_HANDLERS(IMAGE_HANDLER) IMAGE_HANDLER_COUNT };
#undef IMAGE_HANDLER

struct image_cost {
    uint64_t count;
    uint32_t least, most; /* cycles from the first instruction to the return, that included */
    uint32_t acts;        /* most cycles to the last register written that the outside sees */
    uint16_t stack;       /* bytes, the processor's own four included */
};

struct image_costs {
    struct image_cost handlers[IMAGE_HANDLER_COUNT];
    uint64_t returned[IMAGE_VECTORS]; /* interrupts, by vector, from which the program went on */
    uint64_t spoiled;                 /* times that it went on with another register, flag or page than before */
    uint16_t ram;                     /* bytes of data memory from its start to the stack's deepest end */
    uint64_t boots, cycles;           /* of the processor, over all nodes */
    uint64_t boot_most;               /* cycles from reset to idle */
};

const struct image_table *image_port_table(void);
struct image_costs image_port_costs(void);

#endif
