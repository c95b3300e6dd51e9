/* The dsPIC's SPI2 as slave in mode 1 with 16-bit words: MISO changes on the rising edge, MOSI is taken on the falling.
 *
 * Select brings bits back into phase: a word cut short starts again at its first bit. Words are brought back only by
 * arming. After the armed words the last one is sent again (a slave that is not fed repeats its buffer). */
#ifndef LINK_SLAVE_H
#define LINK_SLAVE_H

#include <stdbool.h>
#include <stdint.h>

#include "record.h" // LINK_WORDS

struct link_slave {
    const uint16_t *words; /* armed */
    uint16_t received[LINK_WORDS];
    uint16_t out, in; /* shift registers */
    uint8_t word;     /* words done since arming, at most LINK_WORDS */
    uint8_t bit;      /* bits done of this word */
    bool selected;
    bool sck;
    bool miso; /* true, pulled up, when not selected */
};

void link_slave_reset(struct link_slave *slave);

/* Preloads the first of LINK_WORDS words; they stay unchanged until the next call. */
void link_slave_arm(struct link_slave *slave, const uint16_t *words);

void link_slave_select(struct link_slave *slave, bool low);

/* An edge of SCK; a level that does not change is none. True when it completes LINK_WORDS words, once per arming. */
bool link_slave_sck(struct link_slave *slave, bool level, bool mosi);

#endif
