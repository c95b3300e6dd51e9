/* The pure frame decoder against the golden vectors, field by field and outcome by outcome. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "crc8.h"
#include "vectors.h"
#include "whisker/errors.h"
#include "whisker/frame.h"
#include "whisker_protocol.h"

static struct vector frames[VECTORS_MAX];
static size_t frame_count;

static int outcome(const char *name)
{
    static const struct {
        const char *name;
        int error;
    } outcomes[] = {
        {"ok", WHISKER_OK},
        {"truncated", WHISKER_ERROR_TRUNCATED},
        {"magic", WHISKER_ERROR_MAGIC},
        {"wire_version", WHISKER_ERROR_WIRE_VERSION},
        {"crc", WHISKER_ERROR_HEADER_CRC},
        {"lanes", WHISKER_ERROR_LANES},
        {"record_crc", WHISKER_ERROR_RECORD_CRC},
    };
    for (size_t i = 0; i < sizeof outcomes / sizeof outcomes[0]; i++) {
        if (strcmp(outcomes[i].name, name) == 0) {
            return outcomes[i].error;
        }
    }
    fail_msg("unknown outcome '%s' in frames.txt", name);
    return 0;
}

static int read_vectors(void **state)
{
    (void)state;
    frame_count = vectors_read(WHISKER_VECTORS "/frames.txt", frames);
    return frame_count > 0 ? 0 : -1;
}

static const struct vector *named(const char *name)
{
    const struct vector *found = vector_named(frames, frame_count, name);
    assert_non_null(found);
    return found;
}

static void every_vector_has_its_outcome(void **state)
{
    (void)state;
    for (size_t i = 0; i < frame_count; i++) {
        struct whisker_frame frame;
        const int error = whisker_frame_decode(frames[i].bytes, frames[i].count, &frame);
        if (error != outcome(frames[i].field[0])) {
            fail_msg("%s: %s, expected %s", frames[i].name, whisker_error_name(error), frames[i].field[0]);
        }
    }
}

static void good_frame_has_its_fields(void **state)
{
    (void)state;
    struct whisker_frame frame;
    const struct vector *good = named("good");
    assert_int_equal(whisker_frame_decode(good->bytes, good->count, &frame), 0);
    assert_int_equal(frame.tick, 1000);
    assert_int_equal(frame.time_cycles, 30000000);
    assert_int_equal(frame.sequence, 70000);
    assert_int_equal(frame.dropped, 0);
    assert_int_equal(frame.lane_mask, 0x3F);
    assert_int_equal(frame.flags, 0);
    assert_int_equal(frame.lane[1].alpha, 0x8101);
    assert_int_equal(frame.lane[1].beta, 0x7F7D);
    assert_int_equal(frame.lane[1].status, 0);
    assert_int_equal(frame.lane[5].alpha, 0x8505);
    assert_int_equal(frame.lane[6].status, WHISKER_CODE_LANE_OFF << WHISKER_STATUS_CODE_SHIFT);
}

static void last_and_dropped_are_reported(void **state)
{
    (void)state;
    struct whisker_frame frame;
    const struct vector *last = named("last");
    assert_int_equal(whisker_frame_decode(last->bytes, last->count, &frame), 0);
    assert_int_equal(frame.flags, WHISKER_FRAME_FLAG_LAST);
    const struct vector *dropped = named("dropped_before");
    assert_int_equal(whisker_frame_decode(dropped->bytes, dropped->count, &frame), 0);
    assert_int_equal(frame.dropped, 3);
}

/* The good frame as one of another tick. */
static struct vector good_frame_of(uint8_t tick)
{
    struct vector frame = *named("good");
    frame.bytes[WHISKER_FRAME_HEADER_TICK] = tick;
    frame.bytes[WHISKER_FRAME_HEADER_CRC] = whisker_crc8(frame.bytes, WHISKER_FRAME_HEADER_CRC);
    for (size_t lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        uint8_t *record = frame.bytes + WHISKER_FRAME_HEADER_BYTES + lane * WHISKER_RECORD_BYTES;
        record[WHISKER_RECORD_TICK] = tick;
        record[WHISKER_RECORD_CRC] = whisker_crc8(record, WHISKER_RECORD_CRC);
    }
    return frame;
}

/* What the host makes of a record that a bridge would have replaced, had it come from a node. */
static int expected_outcome(const char *verdict)
{
    return !strcmp(verdict, "good")        ? WHISKER_OK
           : !strcmp(verdict, "link_tick") ? WHISKER_ERROR_RECORD_TICK
                                           : WHISKER_ERROR_RECORD_CRC;
}

static void every_record_vector_is_kept_or_flagged(void **state)
{
    (void)state;
    static struct vector records[VECTORS_MAX];
    const size_t count = vectors_read(WHISKER_VECTORS "/records.txt", records);
    unsigned seen = 0;
    for (size_t i = 0; i < count; i++) {
        struct vector bytes = good_frame_of((uint8_t)atoi(records[i].field[0]));
        memcpy(bytes.bytes + WHISKER_FRAME_HEADER_BYTES + 3 * WHISKER_RECORD_BYTES, records[i].bytes, 8);
        const int outcome = expected_outcome(records[i].field[1]);
        const unsigned code = outcome == WHISKER_ERROR_RECORD_TICK ? WHISKER_CODE_LINK_TICK : WHISKER_CODE_LINK_CRC;
        const unsigned kept = whisker_get_u16(records[i].bytes + WHISKER_RECORD_STATUS);
        struct whisker_frame frame;
        assert_int_equal(whisker_frame_decode(bytes.bytes, bytes.count, &frame), outcome);
        assert_int_equal(frame.lane[3].status, outcome ? code << WHISKER_STATUS_CODE_SHIFT : kept);
        assert_int_equal(frame.lane[3].alpha, outcome ? 0 : whisker_get_u16(records[i].bytes + 1));
        assert_int_equal(frame.lane[4].alpha, 0x8404); /* its neighbour is untouched */
        seen |= 1u << -outcome;
    }
    assert_int_equal(seen, 1u | 1u << -WHISKER_ERROR_RECORD_CRC | 1u << -WHISKER_ERROR_RECORD_TICK);
}

static void any_flipped_bit_is_noticed(void **state)
{
    (void)state;
    const struct vector *good = named("good");
    for (size_t bit = 0; bit < good->count * 8; bit++) {
        uint8_t bytes[VECTOR_BYTES];
        memcpy(bytes, good->bytes, sizeof bytes);
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        struct whisker_frame frame;
        assert_int_not_equal(whisker_frame_decode(bytes, sizeof bytes, &frame), WHISKER_OK);
    }
}

static void crc_table_agrees_with_the_protocol(void **state)
{
    (void)state;
    assert_int_equal(crc8_table_driven((const uint8_t *)"123456789", 9), WHISKER_CRC8_CHECK);
    for (unsigned byte = 0; byte < 256; byte++) {
        const uint8_t bytes[2] = {(uint8_t)byte, (uint8_t)(byte * 7)};
        assert_int_equal(crc8_table_driven(bytes, 2), whisker_crc8(bytes, 2));
    }
}

static void errors_have_names_texts_and_remedies(void **state)
{
    (void)state;
    assert_string_equal(whisker_error_name(0), "OK");
    assert_string_equal(whisker_error_name(WHISKER_ERROR_OVERRUN), "OVERRUN");
    assert_string_equal(whisker_error_name(-999), "UNKNOWN");
#define CHECK(name, code, text, remedy)                                                                                \
    assert_string_equal(whisker_error_text(code), text);                                                               \
    assert_string_equal(whisker_error_remedy(code), remedy);
    WHISKER_ERRORS(CHECK)
#undef CHECK
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_vector_has_its_outcome),
        cmocka_unit_test(good_frame_has_its_fields),
        cmocka_unit_test(last_and_dropped_are_reported),
        cmocka_unit_test(every_record_vector_is_kept_or_flagged),
        cmocka_unit_test(any_flipped_bit_is_noticed),
        cmocka_unit_test(crc_table_agrees_with_the_protocol),
        cmocka_unit_test(errors_have_names_texts_and_remedies),
    };
    return cmocka_run_group_tests_name("frame", tests, read_vectors, NULL);
}
