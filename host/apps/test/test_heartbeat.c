/* The supervisor's heartbeat, from a pipe of the test's own and by its clock. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "heartbeat.h"

/* Begins to watch a pipe; returns the supervisor's end. */
static int watch(struct heartbeat *heartbeat, int64_t now_ms)
{
    int ends[2];
    char number[16];
    assert_int_equal(pipe2(ends, O_NONBLOCK), 0);
    snprintf(number, sizeof number, "%d", ends[0]);
    assert_int_equal(setenv(HEARTBEAT_VARIABLE, number, 1), 0);
    assert_true(heartbeat_begin(heartbeat, now_ms));
    assert_int_equal(heartbeat->fd, ends[0]);
    return ends[1];
}

static void each_byte_says_that_the_supervisor_lives_on(void **state)
{
    (void)state;
    struct heartbeat heartbeat;
    const int supervisor = watch(&heartbeat, 1000);
    assert_int_equal(fcntl(heartbeat.fd, F_GETFD), FD_CLOEXEC);
    assert_int_equal(heartbeat_until_ms(&heartbeat), 1000 + HEARTBEAT_LOST_MS);
    assert_true(heartbeat_read(&heartbeat, 1100)); /* nothing has come */
    assert_int_equal(heartbeat_until_ms(&heartbeat), 1000 + HEARTBEAT_LOST_MS);
    assert_int_equal(write(supervisor, "..", 2), 2);
    assert_true(heartbeat_read(&heartbeat, 1200));
    assert_int_equal(heartbeat_until_ms(&heartbeat), 1200 + HEARTBEAT_LOST_MS);
    close(supervisor);
    close(heartbeat.fd);
}

static void the_end_of_the_pipe_ends_the_watch(void **state)
{
    (void)state;
    struct heartbeat heartbeat;
    const int supervisor = watch(&heartbeat, 1000), watched = heartbeat.fd;
    close(supervisor);
    assert_false(heartbeat_read(&heartbeat, 1100));
    assert_int_equal(heartbeat.fd, -1);
    assert_int_equal(fcntl(watched, F_GETFD), -1);
    assert_int_equal(heartbeat_until_ms(&heartbeat), INT64_MAX);
}

static void without_a_supervisor_nothing_is_watched(void **state)
{
    (void)state;
    struct heartbeat heartbeat;
    assert_int_equal(unsetenv(HEARTBEAT_VARIABLE), 0);
    assert_true(heartbeat_begin(&heartbeat, 1000));
    assert_int_equal(heartbeat.fd, -1);
    assert_int_equal(heartbeat_until_ms(&heartbeat), INT64_MAX);
}

static void what_names_no_open_descriptor_is_refused(void **state)
{
    (void)state;
    static const char *const names[] = {"", "pipe", "3x", "-1", "1000", "99999999999"};
    struct heartbeat heartbeat;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        assert_int_equal(setenv(HEARTBEAT_VARIABLE, names[i], 1), 0);
        assert_false(heartbeat_begin(&heartbeat, 1000));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_byte_says_that_the_supervisor_lives_on),
        cmocka_unit_test(the_end_of_the_pipe_ends_the_watch),
        cmocka_unit_test(without_a_supervisor_nothing_is_watched),
        cmocka_unit_test(what_names_no_open_descriptor_is_refused),
    };
    return cmocka_run_group_tests_name("heartbeat", tests, NULL, NULL);
}
