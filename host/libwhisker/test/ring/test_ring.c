/* The ring, writer and readers in one process: windows, losses and ends. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "ring_fixture.h"
#include "ring_layout.h"
#include "vectors.h"
#include "whisker/errors.h"

/* Reads everything there is; each frame must be the next one. Returns the index after the last. */
static uint64_t read_all(struct whisker_reader *reader, uint64_t index)
{
    const struct whisker_frame *frames;
    size_t count;
    assert_int_equal(whisker_reader_peek(reader, &frames, &count), 0);
    for (size_t i = 0; i < count; i++) {
        assert_true(test_frame_is(&frames[i], index + i));
    }
    assert_int_equal(whisker_reader_advance(reader, count), 0);
    return index + count;
}

static void frames_come_in_order_and_once(void **state)
{
    const struct test_ring_pair *f = *state;
    test_publish(f->ring, 0, 10);
    assert_int_equal(read_all(f->reader, 0), 10);
    assert_int_equal(read_all(f->reader, 10), 10);
    test_publish(f->ring, 10, 1);
    assert_int_equal(read_all(f->reader, 10), 11);
}

static void what_the_nodes_answered_is_read_whole_and_goes_with_the_ring(void **state)
{
    const struct test_ring_pair *f = *state;
    char text[64], small[4];
    int64_t first_ns, then_ns;
    const char *name = test_ring_name();
    const uint32_t owner = WHISKER_RING_NO_OWNER;
    assert_int_equal(whisker_ring_nodes(name, owner, text, sizeof text, &first_ns), WHISKER_ERROR_RING_MISSING);
    assert_int_equal(whisker_ring_set_nodes(f->ring, "lane 0: serial 7, a long line\n"), 0);
    assert_int_equal(whisker_ring_nodes(name, owner, text, sizeof text, &first_ns), 0);
    assert_string_equal(text, "lane 0: serial 7, a long line\n");
    assert_int_equal(whisker_ring_set_nodes(f->ring, "none\n"), 0);
    assert_int_equal(whisker_ring_nodes(name, owner, text, sizeof text, &then_ns), 0);
    assert_string_equal(text, "none\n");
    assert_true(then_ns >= first_ns);
    assert_int_equal(whisker_ring_nodes(name, owner, small, sizeof small, &then_ns), 0);
    assert_string_equal(small, "non");
    assert_int_equal(whisker_ring_nodes(name, owner, small, 0, &then_ns), WHISKER_ERROR_ARGUMENT);
    assert_int_equal(whisker_ring_nodes("a/b", owner, text, sizeof text, &then_ns), WHISKER_ERROR_RING_NAME);
    char path[256];
    snprintf(path, sizeof path, "/dev/shm/.%s.nodes", name);
    assert_int_equal(access(path, R_OK), 0);
    whisker_ring_close(f->ring);
    ((struct test_ring_pair *)*state)->ring = NULL;
    assert_int_not_equal(access(path, R_OK), 0);
}

static void window_across_the_wrap_is_one_array(void **state)
{
    const struct test_ring_pair *f = *state;
    test_publish(f->ring, 0, TEST_CAPACITY - 5);
    read_all(f->reader, 0);
    test_publish(f->ring, TEST_CAPACITY - 5, TEST_CAPACITY); /* a full ring that begins 5 frames before its end */
    const struct whisker_frame *frames;
    size_t count;
    assert_int_equal(whisker_reader_peek(f->reader, &frames, &count), 0);
    assert_int_equal(count, TEST_CAPACITY);
    assert_int_equal(read_all(f->reader, TEST_CAPACITY - 5), 2 * TEST_CAPACITY - 5);
}

static void batch_across_the_wrap_arrives_whole(void **state)
{
    const struct test_ring_pair *f = *state;
    struct whisker_frame batch[TEST_CAPACITY / 4 + 1];
    for (uint64_t first = 0; first < 5 * TEST_CAPACITY; first += 13) {
        for (uint64_t i = 0; i < 13; i++) {
            batch[i] = test_frame(first + i);
        }
        assert_int_equal(whisker_ring_publish(f->ring, batch, 13), 0);
        assert_int_equal(read_all(f->reader, first), first + 13);
    }
    assert_int_equal(whisker_ring_publish(f->ring, batch, TEST_CAPACITY / 4 + 1), WHISKER_ERROR_ARGUMENT);
}

static void overtaken_reader_is_reported_and_goes_on(void **state)
{
    const struct test_ring_pair *f = *state;
    test_publish(f->ring, 0, TEST_CAPACITY + 1);
    const struct whisker_frame *frames;
    size_t count;
    assert_int_equal(whisker_reader_peek(f->reader, &frames, &count), WHISKER_ERROR_OVERRUN);
    assert_int_equal(count, 0);
    const uint64_t next = TEST_CAPACITY + 1 - TEST_CAPACITY / 2;
    assert_int_equal(read_all(f->reader, next), TEST_CAPACITY + 1);
    struct whisker_reader_info info;
    whisker_reader_info(f->reader, &info);
    assert_int_equal(info.overruns, 1);
    assert_int_equal(info.frames_overrun, next);
    assert_int_equal(info.frames_missing, 0); /* they were in the ring: the reader was late */
}

static void reader_overtaken_while_it_reads_is_reported(void **state)
{
    const struct test_ring_pair *f = *state;
    test_publish(f->ring, 0, 8);
    const struct whisker_frame *frames;
    size_t count;
    assert_int_equal(whisker_reader_peek(f->reader, &frames, &count), 0);
    test_publish(f->ring, 8, TEST_CAPACITY - 8); /* full: the frames in use are still whole */
    assert_int_equal(whisker_reader_advance(f->reader, 4), 0);
    test_publish(f->ring, TEST_CAPACITY, 5); /* the fifth writes over what is in use */
    assert_int_equal(whisker_reader_advance(f->reader, 4), WHISKER_ERROR_OVERRUN);
}

static void newest_frames_are_one_array_wherever_the_reader_stands(void **state)
{
    const struct test_ring_pair *f = *state;
    const struct whisker_frame *frames;
    assert_int_equal(whisker_reader_window(f->reader, 10, &frames), 0);
    test_publish(f->ring, 0, 4);
    assert_int_equal(whisker_reader_window(f->reader, 10, &frames), 4); /* there are no more */
    assert_true(test_frame_is(&frames[0], 0));
    test_publish(f->ring, 4, TEST_CAPACITY);
    for (uint64_t newest = TEST_CAPACITY + 4; newest < 3 * TEST_CAPACITY; newest++) {
        assert_int_equal(whisker_reader_window(f->reader, TEST_CAPACITY, &frames), TEST_CAPACITY);
        for (uint64_t i = 0; i < TEST_CAPACITY; i++) {
            assert_true(test_frame_is(&frames[i], newest - TEST_CAPACITY + i));
        }
        assert_int_equal(whisker_reader_intact(f->reader), 0);
        test_publish(f->ring, newest, 1);
        assert_int_equal(whisker_reader_intact(f->reader), WHISKER_ERROR_OVERRUN);
    }
    struct whisker_reader_info info;
    whisker_reader_info(f->reader, &info);
    assert_int_equal(info.position, 0);
    assert_int_equal(whisker_reader_window(f->reader, TEST_CAPACITY + 1, &frames), WHISKER_ERROR_ARGUMENT);
}

static void advance_beyond_the_window_is_refused(void **state)
{
    const struct test_ring_pair *f = *state;
    test_publish(f->ring, 0, 3);
    const struct whisker_frame *frames;
    size_t count;
    assert_int_equal(whisker_reader_peek(f->reader, &frames, &count), 0);
    test_publish(f->ring, 3, 1);
    assert_int_equal(whisker_reader_advance(f->reader, 4), WHISKER_ERROR_ARGUMENT);
    assert_int_equal(whisker_reader_advance(f->reader, 2), 0);
    assert_int_equal(whisker_reader_advance(f->reader, 2), WHISKER_ERROR_ARGUMENT);
}

static void missing_sequence_numbers_are_counted(void **state)
{
    const struct test_ring_pair *f = *state;
    test_publish(f->ring, UINT32_MAX - 2, 3);
    read_all(f->reader, UINT32_MAX - 2);
    test_publish(f->ring, UINT64_C(1) << 32, 2); /* the wire's sequence goes on at 0: nothing is missing */
    read_all(f->reader, UINT64_C(1) << 32);
    struct whisker_reader_info info;
    whisker_reader_info(f->reader, &info);
    assert_int_equal(info.frames_missing, 0);
    test_publish(f->ring, (UINT64_C(1) << 32) + 5, 1); /* 2, 3, 4 are missing between two windows */
    read_all(f->reader, (UINT64_C(1) << 32) + 5);
    test_publish(f->ring, (UINT64_C(1) << 32) + 6, 1);
    test_publish(f->ring, (UINT64_C(1) << 32) + 8, 1); /* and 7 inside one */
    const struct whisker_frame *frames;
    size_t count;
    whisker_reader_peek(f->reader, &frames, &count);
    assert_int_equal(whisker_reader_advance(f->reader, 2), 0);
    whisker_reader_info(f->reader, &info);
    assert_int_equal(info.frames_missing, 4);
}

/* The bridge counts ticks without sampling while the bus is asleep: ticks and times jump, the sequence goes on. */
static void ticks_of_a_suspended_bridge_are_not_missing(void **state)
{
    enum { BEFORE = 3, FRAMES = 6, ASLEEP = 4000 };
    const struct test_ring_pair *f = *state;
    for (uint64_t i = 0; i < FRAMES; i++) {
        struct whisker_frame frame = test_frame(i);
        frame.tick += i < BEFORE ? 0 : ASLEEP;
        whisker_ring_publish(f->ring, &frame, 1);
    }
    const struct whisker_frame *frames;
    size_t count;
    assert_int_equal(whisker_reader_peek(f->reader, &frames, &count), 0);
    assert_int_equal(count, FRAMES);
    assert_true(frames[BEFORE].tick - frames[BEFORE - 1].tick == ASLEEP + 1);
    assert_int_equal(whisker_reader_advance(f->reader, count), 0);
    struct whisker_reader_info info;
    whisker_reader_info(f->reader, &info);
    assert_int_equal(info.frames_missing, 0);
}

static void late_reader_starts_at_the_oldest_or_newest(void **state)
{
    const struct test_ring_pair *f = *state;
    test_publish(f->ring, 0, 100);
    struct whisker_reader *late;
    assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &late), 0);
    assert_int_equal(read_all(late, 100 - TEST_CAPACITY), 100);
    whisker_reader_detach(late);
    whisker_reader_seek_latest(f->reader, 3);
    assert_int_equal(read_all(f->reader, 97), 100);
    whisker_reader_seek_latest(f->reader, 10); /* never goes back */
    assert_int_equal(read_all(f->reader, 100), 100);
}

static void closed_ring_is_read_to_its_end(void **state)
{
    struct test_ring_pair *f = *state;
    test_publish(f->ring, 0, 7);
    assert_int_equal(whisker_reader_wait(f->reader, -1), 0);
    whisker_ring_close(f->ring);
    f->ring = NULL;
    assert_false(test_ring_file_exists(test_ring_name()));
    assert_int_equal(whisker_reader_wait(f->reader, -1), 0);
    assert_int_equal(read_all(f->reader, 0), 7);
    assert_int_equal(whisker_reader_wait(f->reader, -1), WHISKER_ERROR_CLOSED);
}

static void empty_ring_times_out(void **state)
{
    const struct test_ring_pair *f = *state;
    assert_int_equal(whisker_reader_wait(f->reader, 0), WHISKER_ERROR_TIMEOUT);
    assert_int_equal(whisker_reader_wait(f->reader, 1), WHISKER_ERROR_TIMEOUT);
}

static void new_ring_of_the_name_is_seen_and_followed(void **state)
{
    struct test_ring_pair *f = *state;
    test_publish(f->ring, 0, 2);
    struct whisker_reader_info before, after;
    whisker_reader_info(f->reader, &before);
    whisker_ring_close(f->ring);
    assert_int_equal(whisker_ring_create(test_ring_name(), 2 * TEST_CAPACITY, &f->ring), 0);
    assert_int_equal(read_all(f->reader, 0), 2); /* what was published is not lost */
    assert_int_equal(whisker_reader_wait(f->reader, -1), WHISKER_ERROR_RESTARTED);
    assert_int_equal(whisker_reader_reattach(f->reader, 0), 0);
    test_publish(f->ring, 500, 1);
    assert_int_equal(read_all(f->reader, 500), 501);
    whisker_reader_info(f->reader, &after);
    assert_int_equal(after.capacity, 2 * TEST_CAPACITY);
    assert_true(after.generation != before.generation);
    assert_int_equal(after.writer_pid, getpid());
}

static void second_writer_is_refused(void **state)
{
    (void)state;
    struct whisker_ring *second;
    assert_int_equal(whisker_ring_create(test_ring_name(), TEST_CAPACITY, &second), WHISKER_ERROR_RING_BUSY);
    assert_null(second);
    struct whisker_reader *reader; /* and the first one has not lost its ring */
    assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &reader), 0);
    whisker_reader_detach(reader);
}

static void bytes_are_decoded_straight_into_the_ring(void **state)
{
    const struct test_ring_pair *f = *state;
    static struct vector vectors[VECTORS_MAX];
    const size_t vector_count = vectors_read(WHISKER_VECTORS "/frames.txt", vectors);
    const struct vector *good = vector_named(vectors, vector_count, "good");
    assert_non_null(good);
    struct whisker_decoder decoder;
    whisker_decoder_init(&decoder);
    const struct whisker_frame *frames;
    size_t made, count;
    assert_int_equal(whisker_ring_feed(f->ring, &decoder, good->bytes, 100, &frames, &made), 0);
    assert_int_equal(made, 0);
    assert_int_equal(whisker_ring_feed(f->ring, &decoder, good->bytes + 100, 156, &frames, &made), 0);
    assert_int_equal(made, 1);
    assert_int_equal(frames[0].tick, 1000);
    assert_int_equal(whisker_reader_peek(f->reader, &frames, &count), 0);
    assert_int_equal(count, 1);
    assert_int_equal(frames[0].tick, 1000);
    uint8_t much[TEST_CAPACITY / 4 * 256] = {0};
    assert_int_equal(whisker_ring_feed(f->ring, &decoder, much, sizeof much, NULL, NULL), WHISKER_ERROR_ARGUMENT);
}

static void clock_and_statistics_are_reported(void **state)
{
    const struct test_ring_pair *f = *state;
    struct whisker_clock clock;
    struct whisker_daemon_stats stats;
    assert_int_equal(whisker_reader_clock(f->reader, &clock), 0);
    assert_int_equal(whisker_reader_stats(f->reader, &stats), 0);
    assert_true(clock.ns_per_cycle == 0 && stats.frames == 0); /* not published yet */
    for (uint64_t i = 1; i <= 3; i++) {
        whisker_ring_set_clock(f->ring, &(struct whisker_clock){.device_cycles = i, .uncertainty_ns = 0.5});
        whisker_ring_set_stats(f->ring, &(struct whisker_daemon_stats){.frames = i, .firmware = "1.0", .serial = "W7"});
        assert_int_equal(whisker_reader_clock(f->reader, &clock), 0);
        assert_int_equal(whisker_reader_stats(f->reader, &stats), 0);
        assert_int_equal(clock.device_cycles, i);
        assert_true(clock.uncertainty_ns == 0.5);
        assert_int_equal(stats.frames, i);
        assert_string_equal(stats.firmware, "1.0");
        assert_string_equal(stats.serial, "W7");
    }
}

/* The table of docs/ring.md is the layout that others program against. */
static void documented_offsets_are_the_real_ones(void **state)
{
    (void)state;
    static const struct {
        const char *field;
        size_t offset, bytes;
    } fields[] = {
#define FIELD(name, bytes) {#name, offsetof(struct ring_header, name), bytes}
        FIELD(magic, 8),  FIELD(generation, 8), FIELD(head, 8),   FIELD(state, 8),
        FIELD(signal, 4), FIELD(claim, 8),      FIELD(clock, 88), FIELD(stats, sizeof((struct ring_header *)0)->stats),
#undef FIELD
    };
    FILE *file = fopen(WHISKER_VECTORS "/../../docs/ring.md", "r");
    assert_non_null(file);
    char line[512], wanted[64];
    size_t found = 0;
    while (fgets(line, sizeof line, file)) {
        for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
            snprintf(wanted, sizeof wanted, "| %zu | %zu | %s", fields[i].offset, fields[i].bytes, fields[i].field);
            found += strncmp(line, wanted, strlen(wanted)) == 0;
        }
    }
    fclose(file);
    assert_int_equal(found, sizeof fields / sizeof fields[0]);
}

static void bad_names_and_sizes_are_refused(void **state)
{
    (void)state;
    struct whisker_ring *ring;
    struct whisker_reader *reader;
    char long_name[400];
    memset(long_name, 'x', sizeof long_name - 1);
    long_name[sizeof long_name - 1] = '\0';
    const char *names[] = {"", "a/b", "..", ".hidden", long_name};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        assert_int_equal(whisker_ring_create(names[i], TEST_CAPACITY, &ring), WHISKER_ERROR_RING_NAME);
        assert_int_equal(whisker_reader_attach(names[i], 0, &reader), WHISKER_ERROR_RING_NAME);
    }
    const uint32_t sizes[] = {0, 32, 100, 1u << 21};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        assert_int_equal(whisker_ring_create(test_ring_name(), sizes[i], &ring), WHISKER_ERROR_ARGUMENT);
    }
    assert_int_equal(whisker_reader_attach(test_ring_name(), 0, &reader), WHISKER_ERROR_RING_MISSING);
}

#define WITH_RING(test) cmocka_unit_test_setup_teardown(test, test_open_pair, test_close_pair)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH_RING(frames_come_in_order_and_once),
        WITH_RING(what_the_nodes_answered_is_read_whole_and_goes_with_the_ring),
        WITH_RING(window_across_the_wrap_is_one_array),
        WITH_RING(batch_across_the_wrap_arrives_whole),
        WITH_RING(overtaken_reader_is_reported_and_goes_on),
        WITH_RING(reader_overtaken_while_it_reads_is_reported),
        WITH_RING(newest_frames_are_one_array_wherever_the_reader_stands),
        WITH_RING(advance_beyond_the_window_is_refused),
        WITH_RING(missing_sequence_numbers_are_counted),
        WITH_RING(ticks_of_a_suspended_bridge_are_not_missing),
        WITH_RING(late_reader_starts_at_the_oldest_or_newest),
        WITH_RING(closed_ring_is_read_to_its_end),
        WITH_RING(empty_ring_times_out),
        WITH_RING(new_ring_of_the_name_is_seen_and_followed),
        WITH_RING(second_writer_is_refused),
        WITH_RING(bytes_are_decoded_straight_into_the_ring),
        WITH_RING(clock_and_statistics_are_reported),
        cmocka_unit_test(documented_offsets_are_the_real_ones),
        cmocka_unit_test(bad_names_and_sizes_are_refused),
    };
    return cmocka_run_group_tests_name("ring", tests, NULL, NULL);
}
