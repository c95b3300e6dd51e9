/* The ring under threads: what is published is visible, and a frame that advance vouches for was never torn. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <pthread.h>
#include <sched.h>

#include "ring_fixture.h"
#include "ring_internal.h"
#include "whisker/errors.h"

#define READERS 3
#define FRAMES 30000u

struct task {
    struct whisker_reader *reader;
    struct whisker_reader over_writers_map;
    ring_word taken; /* frames this reader is done with */
    uint64_t good, bad;
};

/* Reads all frames; those that advance vouches for are judged. */
static void *read_frames(void *argument)
{
    struct task *task = argument;
    while (task->reader->position < FRAMES) {
        const uint64_t position = task->reader->position;
        const struct whisker_frame *frames;
        size_t count;
        if (whisker_reader_peek(task->reader, &frames, &count) != 0) {
            continue;
        }
        uint64_t good = 0;
        for (size_t i = 0; i < count; i++) {
            good += test_frame_is(&frames[i], position + i);
        }
        if (count == 0) {
            sched_yield();
        } else if (whisker_reader_advance(task->reader, count) == 0) {
            task->good += good;
            task->bad += count - good;
        }
        ring_store_release(&task->taken, task->reader->position);
    }
    return NULL;
}

static void start_readers(pthread_t threads[READERS], struct task tasks[READERS])
{
    for (int i = 0; i < READERS; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, read_frames, &tasks[i]), 0);
    }
}

static void join(pthread_t threads[READERS])
{
    for (int i = 0; i < READERS; i++) {
        assert_int_equal(pthread_join(threads[i], NULL), 0);
    }
}

/* All readers use the writer's own mapping, so a thread sanitizer sees writer and readers at one address; the writer
 * waits for them, so only the publication itself orders its writing and their reading. */
static void publication_orders_writing_before_reading(void **state)
{
    (void)state;
    static struct task tasks[READERS];
    struct whisker_ring *ring;
    pthread_t threads[READERS];
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring), 0);
    for (int i = 0; i < READERS; i++) {
        tasks[i].over_writers_map.map = ring->map;
        tasks[i].reader = &tasks[i].over_writers_map;
    }
    start_readers(threads, tasks);
    for (uint64_t index = 0; index < FRAMES; index++) {
        for (int i = 0; i < READERS; i++) {
            while (index - ring_load_acquire(&tasks[i].taken) >= TEST_CAPACITY) {
                sched_yield();
            }
        }
        test_publish(ring, index, 1);
    }
    join(threads);
    for (int i = 0; i < READERS; i++) {
        assert_int_equal(tasks[i].good, FRAMES);
        assert_int_equal(tasks[i].over_writers_map.overruns, 0);
    }
    whisker_ring_close(ring);
}

/* The writer waits for nobody and overtakes its readers; what they receive as whole must be whole. */
static void overtaken_readers_never_accept_a_torn_frame(void **state)
{
    (void)state;
    static struct task tasks[READERS];
    struct whisker_ring *ring;
    pthread_t threads[READERS];
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &ring), 0);
    for (int i = 0; i < READERS; i++) {
        assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &tasks[i].reader), 0);
    }
    start_readers(threads, tasks);
    struct whisker_frame batch[TEST_CAPACITY / 4];
    for (uint64_t index = 0; index < FRAMES; index += TEST_CAPACITY / 4) {
        for (uint64_t i = 0; i < TEST_CAPACITY / 4; i++) {
            batch[i] = test_frame(index + i);
        }
        whisker_ring_publish(ring, batch, TEST_CAPACITY / 4);
    }
    join(threads);
    for (int i = 0; i < READERS; i++) {
        struct whisker_reader_info info;
        whisker_reader_info(tasks[i].reader, &info);
        assert_int_equal(tasks[i].bad, 0);
        assert_int_equal(tasks[i].good + info.frames_overrun, info.position);
        whisker_reader_detach(tasks[i].reader);
    }
    whisker_ring_close(ring);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(publication_orders_writing_before_reading),
        cmocka_unit_test(overtaken_readers_never_accept_a_torn_frame),
    };
    return cmocka_run_group_tests_name("ring under threads", tests, NULL, NULL);
}
