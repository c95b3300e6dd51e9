/* The Pico as wired: pins, the two buses of sensors, the common conversion line, lamp, watchdog. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>

#define BOARD_LANES 16u
#define BOARD_LANE_NONE BOARD_LANES
#define BOARD_BUSES 2u          /* even lanes are on bus 0, odd ones on bus 1 */
#define BOARD_TRANSFER_MAX 4u   /* words of 16 bits: the SPI's FIFO holds twice as many */
#define BOARD_CYCLES_PER_US 60u /* of the protocol's clock; the processor has twice as many */

enum board_start { BOARD_START_POWER, BOARD_START_PIN, BOARD_START_WATCHDOG, BOARD_START_FAULT };

/* Clocks, pins, buses. Returns why the chip began anew. */
enum board_start board_init(void);

/* Begins to send the same n words to a lane on each bus, at once; BOARD_LANE_NONE leaves a bus alone. in_mode_3: the
 * clock idles high. Then board_receive() with the same lanes. */
void board_send(const uint8_t lanes[BOARD_BUSES], const uint16_t *words, uint32_t n, bool in_mode_3);

/* Waits for its end: the answers; that of a bus left alone means nothing. */
void board_receive(const uint8_t lanes[BOARD_BUSES], uint32_t n, uint16_t answers[BOARD_BUSES][BOARD_TRANSFER_MAX]);

/* With one lane: the answer takes the place of the words. */
void board_ask(uint8_t lane, uint16_t words[BOARD_TRANSFER_MAX], uint32_t n, bool in_mode_3);

/* The pulse that begins a conversion of every sensor. */
void board_convert(void);

/* Microseconds since the start, low 32 bits. */
uint32_t board_now(void);

void board_lamp(bool on);

/* Within a second of the last call, or the chip begins anew. */
void board_alive(void);

/* Number of the flash chip: 64 bits, another one for each board. */
uint64_t board_number(void);

/* Into the boot drive of the chip's ROM. */
void board_boot_drive(void);

/* A fault of the processor: begins anew. */
void board_fault(void);

#endif
