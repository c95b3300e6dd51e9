/* The ring between processes: readers and writers killed at any instruction, writers that start at once. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "ring_fixture.h"
#include "ring_internal.h"
#include "whisker/errors.h"

/* Reads and checks what there is. Returns the next index, or UINT64_MAX when a frame that advance vouched for is not
 * the one expected. Being overtaken is allowed and moves the index. */
static uint64_t read_some(struct whisker_reader *reader)
{
    struct whisker_reader_info info;
    const struct whisker_frame *frames;
    size_t count;
    if (whisker_reader_peek(reader, &frames, &count) == 0) {
        whisker_reader_info(reader, &info);
        bool good = true;
        for (size_t i = 0; i < count; i++) {
            good &= test_frame_is(&frames[i], info.position + i);
        }
        if (whisker_reader_advance(reader, count) == 0 && !good) {
            return UINT64_MAX;
        }
    }
    whisker_reader_info(reader, &info);
    return info.position;
}

/* A child that does not outlive the test, however that ends. */
static pid_t fork_tied(void)
{
    const pid_t child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
    }
    return child;
}

static void byte_to(int fd)
{
    if (write(fd, "x", 1) != 1) {
        _exit(99);
    }
}

static void byte_from(int fd)
{
    char byte;
    assert_int_equal(read(fd, &byte, 1), 1);
}

/* In a child: reads for ever, in the way that `tries` selects, until it is killed. */
static void read_until_killed(const char *name, int ready, unsigned tries)
{
    struct whisker_reader *reader;
    if (whisker_reader_attach(name, 0, &reader) != 0) {
        _exit(1);
    }
    byte_to(ready);
    for (;;) {
        if (tries % 2 && whisker_reader_wait(reader, -1) != 0) {
            _exit(2);
        }
        if (read_some(reader) == UINT64_MAX) {
            _exit(3);
        }
    }
}

/* In a child: makes the ring and publishes frames for ever, until it is killed. */
static void write_until_killed(const char *name, int ready)
{
    struct whisker_ring *ring;
    if (whisker_ring_create(name, TEST_CAPACITY, &ring) != 0) {
        _exit(1);
    }
    byte_to(ready);
    for (uint64_t index = 0;; index++) {
        test_publish(ring, index, 1);
    }
}

static void kill_and_reap(pid_t child)
{
    int status;
    kill(child, SIGKILL);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status)); /* it had not ended by itself, with a complaint */
}

static void killed_readers_do_not_matter(void **state)
{
    (void)state;
    const char *name = test_ring_name();
    struct whisker_ring *ring;
    struct whisker_reader *witness;
    int ready[2];
    assert_int_equal(pipe(ready), 0);
    assert_int_equal(whisker_ring_create(name, TEST_CAPACITY, &ring), 0);
    assert_int_equal(whisker_reader_attach(name, 0, &witness), 0);
    uint64_t index = 0;
    srand(1);
    for (unsigned tries = 0; tries < 60; tries++) {
        const pid_t child = fork_tied();
        if (child == 0) {
            read_until_killed(name, ready[1], tries);
        }
        byte_from(ready[0]);
        for (int left = rand() % 2000; left > 0; left--) {
            test_publish(ring, index++, 1);
            assert_true(read_some(witness) == index);
        }
        kill_and_reap(child);
    }
    whisker_reader_detach(witness);
    whisker_ring_close(ring);
    close(ready[0]);
    close(ready[1]);
}

/* Reads what a dead writer has left, to its end. */
static void read_to_the_end(struct whisker_reader *reader, int expected_end)
{
    int end;
    while ((end = whisker_reader_wait(reader, -1)) == 0) {
        assert_true(read_some(reader) != UINT64_MAX);
    }
    assert_int_equal(end, expected_end);
}

static void killed_writer_is_noticed_and_replaced(void **state)
{
    (void)state;
    const char *name = test_ring_name();
    int ready[2];
    assert_int_equal(pipe(ready), 0);
    srand(2);
    for (int tries = 0; tries < 60; tries++) {
        const pid_t child = fork_tied();
        if (child == 0) {
            write_until_killed(name, ready[1]);
        }
        byte_from(ready[0]);
        struct whisker_reader *reader;
        assert_int_equal(whisker_reader_attach(name, 0, &reader), 0);
        const uint64_t enough = (uint64_t)(rand() % 500);
        uint64_t index = 0;
        while (index < enough) {
            assert_int_equal(whisker_reader_wait(reader, -1), 0);
            index = read_some(reader);
            assert_true(index != UINT64_MAX);
        }
        kill_and_reap(child);
        read_to_the_end(reader, WHISKER_ERROR_WRITER_DEAD);
        struct whisker_reader *late; /* a ring without a writer is not offered to newcomers */
        assert_int_equal(whisker_reader_attach(name, 0, &late), WHISKER_ERROR_WRITER_DEAD);
        struct whisker_ring *ring;
        assert_int_equal(whisker_ring_create(name, TEST_CAPACITY, &ring), 0);
        assert_int_equal(whisker_reader_wait(reader, -1), WHISKER_ERROR_RESTARTED);
        assert_int_equal(whisker_reader_reattach(reader, 0), 0);
        test_publish(ring, 0, 3);
        assert_true(read_some(reader) == 3);
        whisker_ring_close(ring);
        whisker_reader_detach(reader);
    }
    close(ready[0]);
    close(ready[1]);
}

/* In a child: tries to become the writer; holds the ring until the pipe is closed. */
static void compete(const char *name, int report, int hold)
{
    struct whisker_ring *ring;
    const int error = whisker_ring_create(name, TEST_CAPACITY, &ring);
    const char outcome = error == 0 ? 'w' : error == WHISKER_ERROR_RING_BUSY ? 'b' : '?';
    char byte;
    const bool reported = write(report, &outcome, 1) == 1;
    const bool released = read(hold, &byte, 1) == 0;
    whisker_ring_close(ring);
    _exit(reported && released ? 0 : 1);
}

static void of_writers_that_start_at_once_one_wins(void **state)
{
    (void)state;
    enum { RIVALS = 6, ROUNDS = 20 };
    const char *name = test_ring_name();
    for (int round = 0; round < ROUNDS; round++) {
        int report[2], hold[2];
        assert_int_equal(pipe(report), 0);
        assert_int_equal(pipe(hold), 0);
        for (int i = 0; i < RIVALS; i++) {
            if (fork_tied() == 0) {
                close(hold[1]);
                compete(name, report[1], hold[0]);
            }
        }
        int winners = 0;
        for (int i = 0; i < RIVALS; i++) {
            char outcome;
            assert_int_equal(read(report[0], &outcome, 1), 1);
            assert_int_not_equal(outcome, '?');
            winners += outcome == 'w';
        }
        assert_int_equal(winners, 1);
        close(hold[1]);
        for (int i = 0; i < RIVALS; i++) {
            int status;
            assert_true(wait(&status) > 0);
            assert_int_equal(status, 0);
        }
        close(hold[0]);
        close(report[0]);
        close(report[1]);
        assert_false(test_ring_file_exists(name));
    }
}

/* In a child: waits for each frame, answers each with a byte, ends when the ring is closed. */
static void answer_each_frame(const char *name, int answers)
{
    struct whisker_reader *reader;
    int end = whisker_reader_attach(name, -1, &reader);
    byte_to(answers);
    while (end == 0 && (end = whisker_reader_wait(reader, -1)) == 0) {
        if (read_some(reader) == UINT64_MAX) {
            _exit(1);
        }
        byte_to(answers);
    }
    _exit(end == WHISKER_ERROR_CLOSED ? 0 : 2);
}

/* Returns when the process sleeps in the kernel. */
static void until_asleep(pid_t process)
{
    char path[64], state = '?';
    snprintf(path, sizeof path, "/proc/%d/stat", (int)process);
    while (state != 'S') {
        FILE *file = fopen(path, "r");
        assert_non_null(file);
        assert_int_equal(fscanf(file, "%*d (%*[^)]) %c", &state), 1);
        fclose(file);
    }
}

static void waiting_reader_is_woken_by_each_publication_and_the_close(void **state)
{
    (void)state;
    int answers[2], status;
    const char *name = test_ring_name();
    assert_int_equal(pipe(answers), 0);
    const pid_t child = fork_tied();
    if (child == 0) {
        answer_each_frame(name, answers[1]);
    }
    struct whisker_ring *ring; /* made after the reader began to wait for it */
    assert_int_equal(whisker_ring_create(name, TEST_CAPACITY, &ring), 0);
    byte_from(answers[0]);
    /* Unwoken, it would look by itself every 100 ms, and the test would take longer than it may. */
    for (uint64_t index = 0; index < 2000; index++) {
        until_asleep(child);
        test_publish(ring, index, 1);
        byte_from(answers[0]);
    }
    whisker_ring_close(ring);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
    close(answers[0]);
    close(answers[1]);
}

/* Publishes until the writer believes that readers wait, or that none does; unbelieving, until the test's time-out. */
static void publish_until(struct whisker_ring *ring, bool readers_wait)
{
    do {
        test_publish(ring, ring->head, 1);
    } while (ring->readers_wait != readers_wait);
}

static void writer_wakes_only_while_a_reader_waits(void **state)
{
    (void)state;
    int answers[2];
    const char *name = test_ring_name();
    struct whisker_ring *ring;
    struct whisker_reader *polling;
    assert_int_equal(pipe(answers), 0);
    assert_int_equal(whisker_ring_create(name, TEST_CAPACITY, &ring), 0);
    assert_int_equal(whisker_reader_attach(name, 0, &polling), 0);
    publish_until(ring, false);
    for (int tries = 0; tries < 100; tries++) {
        read_some(polling);
        assert_int_equal(whisker_reader_wait(polling, 0), WHISKER_ERROR_TIMEOUT); /* a look, not a wait */
        test_publish(ring, ring->head, 1);
        assert_false(ring->readers_wait);
    }
    const pid_t child = fork_tied();
    if (child == 0) {
        read_until_killed(name, answers[1], 1);
    }
    byte_from(answers[0]);
    publish_until(ring, true);
    kill_and_reap(child); /* and the kernel ends its lock */
    publish_until(ring, false);
    whisker_reader_detach(polling);
    whisker_ring_close(ring);
    close(answers[0]);
    close(answers[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(killed_readers_do_not_matter),
        cmocka_unit_test(killed_writer_is_noticed_and_replaced),
        cmocka_unit_test(of_writers_that_start_at_once_one_wins),
        cmocka_unit_test(writer_wakes_only_while_a_reader_waits),
        cmocka_unit_test(waiting_reader_is_woken_by_each_publication_and_the_close),
    };
    return cmocka_run_group_tests_name("ring between processes", tests, NULL, NULL);
}
