/* The stream decoder: cut anywhere, damaged anywhere, it finds every whole frame and says what it skipped. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <string.h>

#include "vectors.h"
#include "whisker/errors.h"
#include "whisker/frame.h"
#include "whisker_protocol.h"

#define STREAM_FRAMES 4
#define STREAM_BYTES (STREAM_FRAMES * WHISKER_FRAME_BYTES)

static struct vector vectors[VECTORS_MAX];
static size_t vector_count;

struct result {
    struct whisker_frame frames[64];
    size_t count;
    struct whisker_decoder decoder;
};

static int read_vectors(void **state)
{
    (void)state;
    vector_count = vectors_read(WHISKER_VECTORS "/frames.txt", vectors);
    return vector_count > 0 ? 0 : -1;
}

static void feed(struct result *result, const uint8_t *bytes, size_t count)
{
    while (whisker_decoder_next(&result->decoder, &bytes, &count, &result->frames[result->count])) {
        result->count++;
        assert_true(result->count < 64);
    }
    assert_int_equal(count, 0);
}

static void begin(struct result *result)
{
    memset(result, 0, sizeof *result);
    whisker_decoder_init(&result->decoder);
}

/* Appends a vector to a stream and returns the stream's new length. */
static size_t append(uint8_t *stream, size_t length, const char *name)
{
    const struct vector *vector = vector_named(vectors, vector_count, name);
    assert_non_null(vector);
    memcpy(stream + length, vector->bytes, vector->count);
    return length + vector->count;
}

static void assert_same(const struct result *a, const struct result *b)
{
    assert_int_equal(a->count, b->count);
    assert_memory_equal(a->frames, b->frames, a->count * sizeof a->frames[0]);
    assert_memory_equal(&a->decoder.counts, &b->decoder.counts, sizeof a->decoder.counts);
}

/* Good frames, rubbish between them with a false start in it, a damaged header, a damaged record, half a frame. */
static size_t rough_stream(uint8_t *stream)
{
    size_t length = append(stream, 0, "tick_zero");
    memcpy(stream + length, "rubbishWK\x01WWK", 12);
    length = append(stream, length + 12, "all_lanes");
    length = append(stream, length, "flipped_sequence_bit");
    length = append(stream, length, "bad_record_crc");
    length = append(stream, length, "truncated_half");
    return append(stream, length, "last");
}

static void frames_in_a_row_are_all_found(void **state)
{
    (void)state;
    uint8_t stream[3 * VECTOR_BYTES];
    size_t length = append(stream, 0, "tick_zero");
    length = append(stream, length, "good");
    length = append(stream, length, "last");
    struct result result;
    begin(&result);
    feed(&result, stream, length);
    assert_int_equal(result.count, 3);
    assert_int_equal(result.frames[0].tick, 0);
    assert_int_equal(result.frames[1].tick, 1000);
    assert_int_equal(result.frames[2].flags, WHISKER_FRAME_FLAG_LAST);
    assert_int_equal(result.decoder.counts.frames, 3);
    assert_int_equal(result.decoder.counts.bytes_skipped, 0);
}

static void rough_stream_loses_only_what_is_damaged(void **state)
{
    (void)state;
    uint8_t stream[8 * VECTOR_BYTES];
    const size_t length = rough_stream(stream);
    struct result result;
    begin(&result);
    feed(&result, stream, length);
    whisker_decoder_end(&result.decoder);
    const struct whisker_decoder_counts *counts = &result.decoder.counts;
    assert_int_equal(result.count, 4);
    assert_int_equal(result.frames[3].flags, WHISKER_FRAME_FLAG_LAST);
    assert_int_equal(counts->frames, 4);
    assert_int_equal(counts->frames_damaged, 1);
    assert_int_equal(counts->bytes_skipped, length - 4 * WHISKER_FRAME_BYTES);
    assert_int_equal(counts->bad_magic, 1);      /* the rubbish */
    assert_int_equal(counts->bad_header_crc, 1); /* the flipped bit */
    assert_int_equal(counts->truncated, 1);      /* the half frame */
}

static void the_cut_between_chunks_does_not_matter(void **state)
{
    (void)state;
    uint8_t stream[8 * VECTOR_BYTES];
    const size_t length = rough_stream(stream);
    struct result whole;
    begin(&whole);
    feed(&whole, stream, length);
    for (size_t cut = 0; cut <= length; cut++) {
        struct result parts;
        begin(&parts);
        feed(&parts, stream, cut);
        feed(&parts, stream + cut, length - cut);
        assert_same(&whole, &parts);
    }
    for (size_t step = 1; step < 600; step += step < 8 ? 1 : 61) {
        struct result parts;
        begin(&parts);
        for (size_t at = 0; at < length; at += step) {
            feed(&parts, stream + at, length - at < step ? length - at : step);
        }
        assert_same(&whole, &parts);
    }
}

static void each_cause_has_its_count(void **state)
{
    (void)state;
    static const char *const causes[] = {"wrong_magic", "wire_version_1", "bad_header_crc", "lanes_27"};
    for (size_t i = 0; i < sizeof causes / sizeof causes[0]; i++) {
        uint8_t stream[2 * VECTOR_BYTES];
        size_t length = append(stream, 0, causes[i]);
        length = append(stream, length, "good");
        struct result result;
        begin(&result);
        feed(&result, stream, length);
        const struct whisker_decoder_counts *counts = &result.decoder.counts;
        const uint64_t seen[] = {counts->bad_magic, counts->bad_wire_version, counts->bad_header_crc,
                                 counts->bad_lanes};
        for (size_t cause = 0; cause < 4; cause++) {
            assert_int_equal(seen[cause], cause == i);
        }
        assert_int_equal(result.count, 1);
        assert_int_equal(counts->bytes_skipped, WHISKER_FRAME_BYTES);
    }
}

static void a_stream_that_ends_inside_a_frame_is_truncated(void **state)
{
    (void)state;
    uint8_t stream[2 * VECTOR_BYTES];
    size_t length = append(stream, 0, "good");
    length = append(stream, length, "truncated_by_one");
    struct result result;
    begin(&result);
    feed(&result, stream, length);
    whisker_decoder_end(&result.decoder);
    assert_int_equal(result.count, 1);
    assert_int_equal(result.decoder.counts.truncated, 1);
}

/* A good frame with another tick. */
static void with_tick(uint8_t *bytes, uint32_t tick)
{
    append(bytes, 0, "good");
    whisker_put_u32(bytes + WHISKER_FRAME_HEADER_TICK, tick);
    bytes[WHISKER_FRAME_HEADER_CRC] = whisker_crc8(bytes, WHISKER_FRAME_HEADER_CRC);
}

static void ticks_go_on_where_the_wire_wraps(void **state)
{
    (void)state;
    static const uint32_t wire[] = {UINT32_MAX - 1, UINT32_MAX, 0, 1, 70000, 0};
    static const uint64_t host[] = {UINT32_MAX - 1ull, UINT32_MAX,           1ull << 32,
                                    (1ull << 32) + 1,  (1ull << 32) + 70000, 0};
    struct result result;
    begin(&result);
    for (size_t i = 0; i < sizeof wire / sizeof wire[0]; i++) {
        uint8_t bytes[VECTOR_BYTES];
        with_tick(bytes, wire[i]);
        feed(&result, bytes, sizeof bytes);
        assert_true(result.frames[i].tick == host[i]);
    }
}

static uint64_t draw(uint64_t *seed)
{
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    return *seed;
}

/* The host's tick after frames of these two ticks of the wire. */
static uint64_t host_tick_after(uint32_t first, uint32_t second)
{
    struct result result;
    uint8_t bytes[VECTOR_BYTES];
    begin(&result);
    with_tick(bytes, first);
    feed(&result, bytes, sizeof bytes);
    with_tick(bytes, second);
    feed(&result, bytes, sizeof bytes);
    assert_int_equal(result.count, 2);
    return result.frames[1].tick;
}

/* Frames around the wrap may be lost, as many as there are: from a tick before it to one after it the host's goes on by
 * what the wire's went on, up to half its range. A longer way back is a bridge that began anew. */
static void the_wrap_may_fall_among_lost_frames(void **state)
{
    (void)state;
    const uint64_t begun = 0x2026112200000001u;
    const uint64_t half = 1ull << 31, range = 1ull << 32;
    uint64_t seed = begun;
    for (int i = 0; i < 2000; i++) {
        const uint64_t before = draw(&seed) >> (33 + draw(&seed) % 31); /* ticks before the wrap, of all sizes */
        const uint64_t after = draw(&seed) >> (33 + draw(&seed) % 31);  /* and after it */
        const uint32_t first = (uint32_t)(range - 1 - before), second = (uint32_t)after;
        const bool goes_on = second >= first || before + 1 + after <= half;
        const uint64_t expected = goes_on && second < first ? range + second : second;
        if (host_tick_after(first, second) != expected) {
            fail_msg("seed %llx, draw %d: after tick %u came %u", (unsigned long long)begun, i, first, second);
        }
    }
    assert_true(host_tick_after(UINT32_MAX, (uint32_t)half - 1) == range + half - 1); /* the longest way on */
    assert_true(host_tick_after(UINT32_MAX, (uint32_t)half) == half);                 /* the shortest way back */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_in_a_row_are_all_found),
        cmocka_unit_test(rough_stream_loses_only_what_is_damaged),
        cmocka_unit_test(the_cut_between_chunks_does_not_matter),
        cmocka_unit_test(each_cause_has_its_count),
        cmocka_unit_test(a_stream_that_ends_inside_a_frame_is_truncated),
        cmocka_unit_test(ticks_go_on_where_the_wire_wraps),
        cmocka_unit_test(the_wrap_may_fall_among_lost_frames),
    };
    return cmocka_run_group_tests_name("decoder", tests, read_vectors, NULL);
}
