/* The firmware on the dsPIC33FJ128MC802: what the core asks of its board, done with the chip's registers.
 *
 *   SYNC   -> INT1                       node_on_sync()
 *   sensor -> SPI1 master, a byte at a time; T2 paces the gaps; T3 runs from SYNC on
 *   link   -> SPI2 slave in 16-bit words; DMA0 feeds it, DMA1 empties it and interrupts when the order is whole;
 *             INT2 tells when select rises
 *
 * All interrupts share one priority, so that the core sees one event at a time. Nothing waits but the clock switch at
 * start-up. */
#ifndef PORT_H
#define PORT_H

#include "chip_board.h"

/* Pins, as numbers of port B and of RP. Sensor lines are open drain on 5 V tolerant pins. docs/hardware.md */
#define PIN_SPARE 6u /* an input, left open */
#define PIN_SENSOR_SELECT 7u
#define PIN_SENSOR_CLOCK 8u
#define PIN_SENSOR_DATA 9u
#define PIN_LINK_SELECT 5u
#define PIN_SYNC 12u
#define PIN_LINK_CLOCK 13u
#define PIN_LINK_MOSI 14u
#define PIN_LINK_MISO 15u

#define BOARD_ASKED_LOADER 0x10ADu
#define BOARD_ASKED_APPLICATION 0xA991u

/* From reset to the choice between application and loader; goes on with port_start() or port_start_loader(). */
void port_boot(struct board *board);

/* To the main loop: clock, pins, peripherals, node. */
void port_start(struct board *board);
void port_start_loader(struct board *board);

/* On the chip, where the loader is a program of its own: leaves for the other. */
void port_jump_to_application(struct board *board);

/* One turn of the main loop: shows the watchdog that interrupts are served, deals with a service order that waits, then
 * idles until the next interrupt. */
void port_loop(struct board *board);

/* Bodies of the interrupts. */
void port_on_int1(struct board *board);
void port_on_t2(struct board *board);
void port_on_spi1(struct board *board);
void port_on_spi1_error(struct board *board);
void port_on_spi2_error(struct board *board);
void port_on_dma1(struct board *board);
void port_on_int2(struct board *board);
void port_on_trap(struct board *board); /* any of the traps; does not return */

/* Steps of port_start, one file each. */
void clock_start(struct board *board);
void pins_start(struct board *board);
void sensor_start(struct board *board);
void link_start(struct board *board);

/* Flag and enable bits of an interrupt. */
#define IRQ_WORD(base, irq) ((uint16_t)((base) + 2u * ((irq) / 16u)))
#define IRQ_BIT(irq) ((uint16_t)(1u << (irq) % 16u))

#endif
