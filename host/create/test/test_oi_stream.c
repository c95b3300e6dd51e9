/* The stream's parser: published frames, and which frames survive lost, extra and corrupt bytes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "create/stream.h"
#include "stream_bytes.h"

#define FRAMES 40
#define TRIALS 2000
#define BEGINNINGS 8 /* [19][19] in a frame of make_frame(): each may be taken for the next one */

static const uint8_t ids[] = {7, 19, 20, 22, 35, 41, 42}; /* one and two bytes, signed and unsigned */

struct feed {
    struct create_stream stream;
    struct create_frame frame; /* the newest */
    int32_t voltages[FRAMES];  /* of each frame: its number */
    size_t frames;
    uint32_t missed;
};

static void push(struct feed *feed, const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (create_stream_push(&feed->stream, bytes[i], &feed->frame)) {
            assert_true(feed->frames < FRAMES);
            feed->missed += feed->frame.missed;
            feed->voltages[feed->frames++] = feed->frame.value[CREATE_OI_VOLTAGE];
        }
    }
}

/* Frame `number`: full of header bytes, that a parser must not take for frames. */
static size_t make_frame(uint8_t *bytes, int number)
{
    const int32_t value[CREATE_OI_PACKET_MAX + 1] = {
        [7] = 19, [19] = 0x1313, [20] = -2, [22] = number, [35] = 2, [41] = 0x1313, [42] = -200};
    return stream_bytes(bytes, ids, sizeof ids, value);
}

/* FRAMES frames in a row; returns the length of one. */
static size_t make_stream(uint8_t *bytes)
{
    size_t length = 0;
    for (int i = 0; i < FRAMES; i++) {
        length = make_frame(bytes + (size_t)i * length, i);
    }
    return length;
}

static struct feed *begin(void)
{
    static struct feed feed;
    memset(&feed, 0, sizeof feed);
    assert_int_not_equal(create_stream_begin(&feed.stream, ids, sizeof ids), 0);
    return &feed;
}

/* Every byte taken in is of a whole frame, skipped, or held. */
static void assert_adds_up(const struct create_stream *stream)
{
    assert_int_equal(stream->counts.bytes,
                     stream->counts.frames * stream->length + stream->counts.skipped + stream->count);
}

static void published_frames_are_read(void **state)
{
    (void)state;
    static const uint8_t asked[] = {29, 13}, of_text[] = {19, 5, 29, 2, 37, 13, 0, 151};
    static const uint8_t of_manual[] = {19, 5, 29, 2, 25, 13, 0, 163};
    struct feed feed = {0};
    assert_int_equal(create_stream_begin(&feed.stream, asked, sizeof asked), sizeof of_text);
    push(&feed, of_text, sizeof of_text);
    assert_int_equal(feed.frames, 1);
    assert_int_equal(feed.frame.value[CREATE_OI_CLIFF_FRONT_LEFT_SIGNAL], 549);
    assert_int_equal(feed.frame.value[CREATE_OI_VIRTUAL_WALL], 0);
    push(&feed, of_manual, sizeof of_manual);
    assert_int_equal(feed.frames, 2);
    assert_int_equal(feed.frame.value[CREATE_OI_CLIFF_FRONT_LEFT_SIGNAL], 537);
    assert_int_equal(feed.stream.counts.corrupt, 0);
}

/* Whatever the memory held: a stream of other packets, half a frame, or rubbish. */
static void a_stream_begun_anew_knows_nothing_of_before(void **state)
{
    (void)state;
    static const uint8_t first[] = {19}, anew[] = {29}, of_anew[] = {19, 3, 29, 2, 37, 166};
    struct feed feed = {0};
    for (int before = 0; before < 2; before++) {
        feed.frames = 0;
        memset(&feed.stream, 0xA5, sizeof feed.stream);
        if (before == 1) {
            create_stream_begin(&feed.stream, first, sizeof first);
            push(&feed, of_anew, 2); /* the beginning of a frame of either */
        }
        assert_int_equal(create_stream_begin(&feed.stream, anew, sizeof anew), sizeof of_anew);
        push(&feed, of_anew, sizeof of_anew);
        assert_int_equal(feed.frames, 1);
        assert_int_equal(feed.frame.value[CREATE_OI_CLIFF_FRONT_LEFT_SIGNAL], 549);
        assert_int_equal(feed.frame.missed, 0);
        assert_int_equal(feed.stream.counts.bytes, sizeof of_anew);
        assert_int_equal(feed.stream.counts.frames, 1);
        assert_int_equal(feed.stream.counts.corrupt + feed.stream.counts.skipped + feed.stream.counts.resyncs, 0);
    }
}

static void values_have_their_signs(void **state)
{
    (void)state;
    uint8_t bytes[CREATE_STREAM_BYTES];
    struct feed *feed = begin();
    push(feed, bytes, make_frame(bytes, 0xFFFF));
    assert_int_equal(feed->frame.value[CREATE_OI_VOLTAGE], 65535);
    assert_int_equal(feed->frame.value[CREATE_OI_ANGLE], -2);
    assert_int_equal(feed->frame.value[CREATE_OI_REQUESTED_LEFT], -200);
    const uint8_t temperature = 0xF6;
    assert_int_equal(create_packet_value(CREATE_OI_TEMPERATURE, &temperature), -10);
}

static void what_cannot_be_asked_for_is_refused(void **state)
{
    (void)state;
    struct create_stream stream;
    const uint8_t unknown[] = {7, 59}, group[] = {0}, most[] = {255};
    assert_int_equal(create_stream_begin(&stream, unknown, 2), 0);
    assert_int_equal(create_stream_begin(&stream, group, 1), 0);
    assert_int_equal(create_stream_begin(&stream, most, 1), 0);
    uint8_t many[100];
    memset(many, CREATE_OI_VOLTAGE, sizeof many);
    assert_int_equal(create_stream_begin(&stream, many, sizeof many), 0);
    assert_int_equal(create_stream_begin(&stream, many, 84), 255);
}

/* A frame whose sum is right but which nobody asked for. */
static void assert_refused(const uint8_t *bytes, size_t count)
{
    uint8_t good[CREATE_STREAM_BYTES];
    const size_t length = make_frame(good, 1);
    struct feed *feed = begin();
    push(feed, good, length);
    push(feed, bytes, count);
    push(feed, good, length);
    assert_int_equal(feed->frames, 2);
    assert_int_equal(feed->stream.counts.corrupt, 1);
    assert_int_equal(feed->stream.counts.skipped, count);
    assert_int_equal(feed->stream.counts.resyncs, 1);
    assert_adds_up(&feed->stream);
}

static void frames_nobody_asked_for_are_corrupt(void **state)
{
    (void)state;
    static const uint8_t shorter[] = {7, 19, 20, 22, 35, 41}, unknown[] = {7, 19, 20, 22, 36, 41, 42};
    static const uint8_t turned[] = {7, 20, 19, 22, 35, 41, 42};
    const int32_t value[CREATE_OI_PACKET_MAX + 1] = {0};
    uint8_t bytes[CREATE_STREAM_BYTES];
    assert_refused(bytes, stream_bytes(bytes, shorter, sizeof shorter, value));
    assert_refused(bytes, stream_bytes(bytes, unknown, sizeof unknown, value));
    assert_refused(bytes, stream_bytes(bytes, turned, sizeof turned, value));
}

static void a_stream_begun_in_the_middle_is_no_fault(void **state)
{
    (void)state;
    uint8_t bytes[FRAMES * 64];
    const size_t length = make_stream(bytes);
    struct feed *feed = begin();
    push(feed, bytes + 5, 3 * length - 5);
    assert_int_equal(feed->frames, 2);
    assert_int_equal(feed->frame.missed, 0);
    assert_int_equal(feed->stream.counts.skipped, length - 5);
    assert_int_equal(feed->stream.counts.resyncs, 0);
    assert_adds_up(&feed->stream);
}

static void missed_frames_are_reported(void **state)
{
    (void)state;
    uint8_t bytes[FRAMES * 64];
    const size_t length = make_stream(bytes);
    struct feed *feed = begin();
    bytes[length + 4] ^= 0x40;     /* frame 1 and 2 damaged, 3 whole */
    bytes[2 * length + 1] ^= 0x01; /* its length */
    push(feed, bytes, 4 * length);
    assert_int_equal(feed->frames, 2);
    assert_int_equal(feed->frame.missed, 2);
    assert_int_equal(feed->stream.counts.resyncs, 1);
    assert_adds_up(&feed->stream);
}

enum damage { LOSE, FLIP, INSERT, KINDS };

/* One fault at a place: writes the damaged stream, returns its length. */
static size_t spoil(uint8_t *out, const uint8_t *bytes, size_t count, enum damage kind, size_t at)
{
    memcpy(out, bytes, at);
    const size_t skip = kind == LOSE ? 1 : 0, gap = kind == INSERT ? 1 : 0;
    out[at] = (uint8_t)(rand() & 0xFF);
    memcpy(out + at + gap, bytes + at + skip, count - at - skip);
    if (kind == FLIP) {
        out[at] ^= (uint8_t)(1u << (rand() & 7));
    }
    return count - skip + gap;
}

/* Every frame the fault did not touch must come, and no other. */
static void exactly_the_damaged_frame_is_lost(void **state)
{
    (void)state;
    uint8_t bytes[FRAMES * 64], damaged[FRAMES * 64 + 1];
    const size_t length = make_stream(bytes);
    srand(1);
    for (int trial = 0; trial < TRIALS; trial++) {
        const size_t at = length + (size_t)rand() % (length * (FRAMES - 2));
        const enum damage kind = (enum damage)(trial % KINDS);
        const bool between = kind == INSERT && at % length == 0;
        const size_t count = spoil(damaged, bytes, length * FRAMES, kind, at);
        struct feed *feed = begin();
        push(feed, damaged, count);
        assert_int_equal(feed->frames, between ? FRAMES : FRAMES - 1);
        assert_int_equal(feed->missed, between ? 0 : 1);
        for (size_t i = 0; i < feed->frames; i++) {
            assert_int_equal(feed->voltages[i], i + (!between && i >= at / length ? 1 : 0));
        }
        assert_int_equal(feed->stream.counts.resyncs, 1);
        assert_in_range(feed->stream.counts.corrupt, 1, BEGINNINGS);
        assert_adds_up(&feed->stream);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(published_frames_are_read),
        cmocka_unit_test(a_stream_begun_anew_knows_nothing_of_before),
        cmocka_unit_test(values_have_their_signs),
        cmocka_unit_test(what_cannot_be_asked_for_is_refused),
        cmocka_unit_test(frames_nobody_asked_for_are_corrupt),
        cmocka_unit_test(a_stream_begun_in_the_middle_is_no_fault),
        cmocka_unit_test(missed_frames_are_reported),
        cmocka_unit_test(exactly_the_damaged_frame_is_lost),
    };
    return cmocka_run_group_tests_name("stream", tests, NULL, NULL);
}
