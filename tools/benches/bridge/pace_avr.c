// The firmware's record, packed and parsed over and over on an ATmega1284P: how many cycles that takes, by its timer.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdio.h>

#include "machine.h"
#include "record.h"

static volatile uint32_t rounds_of_timer;

ISR(TIMER1_OVF_vect)
{
    rounds_of_timer++;
}

int main(void)
{
    struct sensor_reading reading = {0};
    struct order order;
    uint16_t words[LINK_WORDS];
    uint16_t good = 0;
    machine_start();
    TIMSK1 = 1 << TOIE1;
    TCCR1B = 1 << CS10; // every cycle
    sei();
    for (uint16_t n = 0; n < REPEATS; n++) {
        reading.alpha = n;
        record_pack(&reading, (uint8_t)n, words);
        good += record_parse_order(words, &order);
    }
    cli();
    printf("cycles %lu, %u orders\n", (unsigned long)rounds_of_timer << 16, good);
    machine_stop();
}
