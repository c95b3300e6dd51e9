/* A ring name of this process, frames that know their index, and what the ring tests share. */
#ifndef WHISKER_TEST_RING_FIXTURE_H
#define WHISKER_TEST_RING_FIXTURE_H

#include <stdbool.h>
#include <stdint.h>

#include "whisker/ring.h"

#define TEST_CAPACITY 64u

/* A ring and a reader of it. */
struct test_ring_pair {
    struct whisker_ring *ring;
    struct whisker_reader *reader;
};

/* Set-up and teardown of a test: opens a pair under the test's name; closes it, which must leave no file. */
int test_open_pair(void **state);
int test_close_pair(void **state);

/* A name no other test process uses, but those forked after the first call. */
const char *test_ring_name(void);

/* Frame number `index`: every field follows from it. */
struct whisker_frame test_frame(uint64_t index);

/* Whether the frame is the one of this index, in every field. */
bool test_frame_is(const struct whisker_frame *frame, uint64_t index);

/* Publishes the frames of indices first .. first + count - 1, one at a time. */
void test_publish(struct whisker_ring *ring, uint64_t first, uint64_t count);

/* Whether the ring of this name has a file in shared memory. */
bool test_ring_file_exists(const char *name);

#endif
