/* Records out, orders in: what the node link carries, as the 16-bit words of the SPI slave. */
#ifndef RECORD_H
#define RECORD_H

#include <stdbool.h>
#include <stdint.h>

#include "sensor_frame.h"     // struct sensor_reading
#include "whisker_protocol.h" // WHISKER_RECORD_BYTES

#define LINK_WORDS (WHISKER_RECORD_BYTES / 2u) /* a record and an order are equally long */

/* The record of one tick as four words, first byte in the high half. `tick`: low 8 bits of the tick's number. */
void record_pack(const struct sensor_reading *reading, uint8_t tick, uint16_t words[LINK_WORDS]);

/* What the bridge asks while it clocks out the records. */
struct order {
    uint8_t tick;    /* low 8 bits of the tick whose SYNC came just before */
    uint8_t command; /* WHISKER_COMMAND_* */
};

/* False, and `order` untouched, if the CRC of the four received words is wrong. */
bool record_parse_order(const uint16_t words[LINK_WORDS], struct order *order);

#endif
