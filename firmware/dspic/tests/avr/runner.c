#include <avr/pgmspace.h>
#include <setjmp.h>

#include "cmocka.h"
#include "machine.h"

static jmp_buf next_test;

void fail_at(const char *what, uint16_t line)
{
    printf("FAILED line %u: %s\n", line, what);
    longjmp(next_test, 1);
}

int run_tests(const struct CMUnitTest *tests, uint16_t count)
{
    /* Static, for longjmp may change any variable of this function that is in a register. */
    static const struct CMUnitTest *test, *end;
    static uint16_t passed, all;
    all = count;
    machine_start();
    for (test = tests, end = tests + all; test < end; test++) {
        if (setjmp(next_test) == 0) {
            test->function(NULL);
            passed++;
        } else {
            printf("FAILED %s\n", test->name);
        }
    }
    printf("%u of %u tests passed, int has %u bits\n", passed, all, 8 * (uint16_t)sizeof(int));
    machine_stop();
    return 0;
}

static const char VECTORS_TEXT[] PROGMEM = {
#include VECTORS_INC
    0};

static const char *reading = VECTORS_TEXT;

static int get(FILE *stream)
{
    const char c = (char)pgm_read_byte(reading);
    (void)stream;
    if (c == 0)
        return _FDEV_EOF;
    reading++;
    return (unsigned char)c;
}

FILE *vectors_open(void)
{
    static FILE file = FDEV_SETUP_STREAM(NULL, get, _FDEV_SETUP_READ);
    return &file;
}
