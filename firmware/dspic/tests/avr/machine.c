#include "machine.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdio.h>

static int put(char c, FILE *stream)
{
    (void)stream;
    loop_until_bit_is_set(UCSR0A, UDRE0);
    UDR0 = (uint8_t)c;
    return 0;
}

static FILE serial = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);

void machine_start(void)
{
    UCSR0B = 1 << TXEN0;
    stdout = &serial;
}

void machine_stop(void)
{
    cli();
    sleep_mode();
    for (;;) {
    }
}
