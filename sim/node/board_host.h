/* The host port of the firmware's board: one node's peripherals in virtual time. */
#ifndef BOARD_HOST_H
#define BOARD_HOST_H

#include <stdbool.h>
#include <stdint.h>

#include "link_slave.h"     // struct link_slave
#include "mlx90333_model.h" // struct mlx90333

#define BOARD_NEVER UINT64_MAX

/* SPI1 and one timer, with the sensor behind SPI1 and SPI2 as the link's slave. */
struct board {
    uint64_t now_ns;
    uint64_t timer_ns; /* when the timer elapses, or BOARD_NEVER */
    uint64_t byte_ns;  /* when the byte being clocked ends, or BOARD_NEVER */
    uint32_t misuses;  /* breaches of the board's contract by the firmware */
    uint8_t sending;
    struct mlx90333 sensor;
    struct link_slave link;
    uint16_t armed[LINK_WORDS]; /* the link's words as they were when armed */
};

/* Reset at `now_ns`, sensor not yet powered. */
void board_reset(struct board *board, uint64_t now_ns);

/* When the next event is due, or BOARD_NEVER. */
uint64_t board_next_ns(const struct board *board);

/* Clocks the byte that is due through the sensor and returns what was read. */
uint8_t board_clock_byte(struct board *board);

#endif
