/* What each interrupt of the firmware costs: cycles of its handler from its vector on, on the longest path found. The
 * one place where they are stated: the model of the node and all benches take them from here.
 *
 * X(name, register, acts, whole): `acts` until it first writes the register by which it does what others wait for (0:
 * there is none), `whole` until its return is done. The processor's entry comes on top. Source: the images of
 * firmware/images, run instruction by instruction (tests/rigs/node_image) for 10000 ticks with random faults, and
 * through service orders; of three images, the longest. */
#ifndef NODE_CYCLES_H
#define NODE_CYCLES_H

#define NODE_CYCLES(X)                                                                                                 \
    X(SYNC, SPI1BUF, 45, 204)              /* INT1: the sensor's first byte */                                         \
    X(BYTE, T2CON, 54, 107)                /* SPI1, but for the frame's last byte: the gap begins */                   \
    X(LAST_BYTE, DMA0CON, 761, 837)        /* SPI1: the link is being armed */                                         \
    X(GAP, SPI1BUF, 53, 85)                /* T2: the next byte */                                                     \
    X(RAISE, LATB, 44, 110)                /* T2: /SS up */                                                            \
    X(LOWER, LATB, 46, 110)                /* T2: /SS down */                                                          \
    X(READY, 0, 0, 98)                     /* T2, also at the end of the start-up */                                   \
    X(ORDER, DMA0CON, 632, 774)            /* DMA1: the link is being armed */                                         \
    X(SERVICE, 0, 0, 491)                  /* DMA1: a service order is taken */                                        \
    X(SELECT_UP, 0, 0, 59)                 /* INT2 after a whole transfer */                                           \
    X(SELECT_UP_BROKEN, DMA0CON, 337, 416) /* INT2 after another: the link is armed anew */

#endif
