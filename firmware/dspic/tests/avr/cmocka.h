/* The few assertions of cmocka that the core's tests use, for a machine without an operating system. */
#ifndef CMOCKA_H
#define CMOCKA_H

#include <stdint.h>
#include <stdio.h>
#include <string.h>

struct CMUnitTest {
    const char *name;
    void (*function)(void **state);
};

#define cmocka_unit_test(function)                                                                                     \
    {                                                                                                                  \
#function, function                                                                                            \
    }
#define cmocka_run_group_tests(tests, setup, teardown) run_tests(tests, sizeof(tests) / sizeof *(tests))

/* Runs all, says so on the serial port, stops the machine. Never returns. */
int run_tests(const struct CMUnitTest *tests, uint16_t count);

static inline int is_within(int32_t value, int32_t low, int32_t high)
{
    return value >= low && value <= high;
}

/* Ends the present test. */
void fail_at(const char *what, uint16_t line);

#define assert_true(c) ((c) ? (void)0 : fail_at(#c, __LINE__))
#define assert_false(c) assert_true(!(c))
#define assert_non_null(p) assert_true((p) != NULL)
#define assert_int_equal(a, b) assert_true((int32_t)(a) == (int32_t)(b))
#define assert_int_not_equal(a, b) assert_true((int32_t)(a) != (int32_t)(b))
#define assert_in_range(v, low, high) assert_true(is_within((int32_t)(v), (int32_t)(low), (int32_t)(high)))
#define assert_memory_equal(a, b, n) assert_true(memcmp(a, b, n) == 0)
#define fail_msg(...) fail_at("a golden vector", __LINE__)

/* The only file there is: the golden vectors, linked in. */
FILE *vectors_open(void);
#define fopen(name, mode) vectors_open()
#define fclose(file) ((void)(file))

#endif
