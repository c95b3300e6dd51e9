#include <avr/pgmspace.h>
#include <setjmp.h>
#include <stdbool.h>

#include "cmocka.h"
#include "machine.h"

static jmp_buf next_test;

void fail_at(const char *what, uint16_t line)
{
    printf("FAILED line %u: %s\n", line, what);
    longjmp(next_test, 1);
}

/* Whether a test passed. In a function of its own: longjmp leaves the caller's variables as they were. */
__attribute__((noinline)) static bool passes(const struct CMUnitTest *test)
{
    if (setjmp(next_test) != 0)
        return false;
    test->function(NULL);
    return true;
}

int run_tests(const struct CMUnitTest *tests, uint16_t count)
{
    uint16_t passed = 0;
    machine_start();
    for (uint16_t i = 0; i < count; i++) {
        if (passes(&tests[i]))
            passed++;
        else
            printf("FAILED %s\n", tests[i].name);
    }
    printf("%u of %u tests passed, int has %u bits\n", passed, count, 8 * (uint16_t)sizeof(int));
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
