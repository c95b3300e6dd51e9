/* The frame decoder against a reference that works bit by bit and knows nothing of bytes or of the generated tables. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <string.h>

#include "sensor_frame.h"
#include "whisker_protocol.h"

/* Value of `n` bits from byte `first_byte` on: least significant byte first, most significant bit first. */
static unsigned field_of(const uint8_t frame[8], unsigned first_byte, unsigned n)
{
    unsigned value = 0;
    for (unsigned bit = 0; bit < n; bit++) {
        const unsigned sent_at = 8 * (first_byte + bit / 8) + (7 - bit % 8);
        const unsigned level = (unsigned)frame[sent_at / 8] >> (7 - sent_at % 8) & 1u;
        value += level << bit;
    }
    return value;
}

/* The error word's table, read from the data sheet a second time: place of bits 2 to 9, 11, 15 in the status. */
static unsigned reference_errors(unsigned word)
{
    unsigned status = 0;
    for (unsigned bit = 2; bit <= 9; bit++)
        status |= (word >> bit & 1u) << (bit - 2);
    status |= (word >> 11 & 1u) << 8;
    status |= (word >> 15 & 1u) << 9;
    return status;
}

static unsigned reference_code(const uint8_t frame[8])
{
    unsigned ones = 0;
    for (unsigned bit = 0; bit < 64; bit++)
        ones += (unsigned)frame[bit / 8] >> bit % 8 & 1u;
    if (ones == 64)
        return WHISKER_CODE_SENSOR_ABSENT;
    if (field_of(frame, 0, 8) != 255)
        return WHISKER_CODE_SENSOR_START;
    unsigned angles = 0, errors = 0;
    for (unsigned i = 1; i <= 4; i++)
        angles += field_of(frame, i, 8);
    for (unsigned i = 5; i <= 6; i++)
        errors += field_of(frame, i, 8);
    const unsigned sum = field_of(frame, 7, 8);
    const unsigned word = field_of(frame, 5, 16);
    if ((word & 0x7403u) != 0)
        return WHISKER_CODE_SENSOR_SUM;
    if (sum == (angles + errors) % 256)
        return WHISKER_CODE_OK;
    if (word != 0 && sum == angles % 256)
        return WHISKER_CODE_OK;
    return WHISKER_CODE_SENSOR_SUM;
}

static void assert_as_reference(const uint8_t frame[8])
{
    const struct sensor_reading reading = sensor_frame_decode(frame);
    const unsigned code = reference_code(frame);
    assert_int_equal(reading.status >> 10, code);
    if (code == WHISKER_CODE_OK) {
        assert_int_equal(reading.alpha, field_of(frame, 1, 16));
        assert_int_equal(reading.beta, field_of(frame, 3, 16));
        assert_int_equal(reading.status, reference_errors(field_of(frame, 5, 16)));
    } else {
        assert_int_equal(reading.alpha, 0);
        assert_int_equal(reading.beta, 0);
        assert_int_equal(reading.status & 0x3FFu, 0);
    }
}

static void make_frame(unsigned alpha, unsigned beta, unsigned errors, uint8_t frame[8])
{
    const uint8_t bytes[7] = {0xFF,
                              (uint8_t)alpha,
                              (uint8_t)(alpha >> 8),
                              (uint8_t)beta,
                              (uint8_t)(beta >> 8),
                              (uint8_t)errors,
                              (uint8_t)(errors >> 8)};
    unsigned sum = 0;
    for (unsigned i = 1; i < 7; i++)
        sum += bytes[i];
    memcpy(frame, bytes, 7);
    frame[7] = (uint8_t)sum;
}

/* Marsaglia's 32-bit xorshift: the same frames in every run. */
static uint32_t next_random(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

static void good_frames_decode_as_the_reference(void **state)
{
    (void)state;
    uint32_t random = 1;
    for (int i = 0; i < 20000; i++) {
        uint8_t frame[8];
        const uint32_t angles = next_random(&random);
        const uint32_t errors = next_random(&random);
        make_frame(angles & 0xFFFFu, angles >> 16, i % 2 ? errors & 0xFFFFu : 0, frame);
        assert_as_reference(frame);
    }
}

static void any_bytes_at_all_decode_as_the_reference(void **state)
{
    (void)state;
    uint32_t random = 2;
    for (int i = 0; i < 20000; i++) {
        uint8_t frame[8];
        for (unsigned k = 0; k < 8; k++)
            frame[k] = (uint8_t)(next_random(&random) >> 24);
        if (i % 2)
            frame[0] = 0xFF;
        if (i % 4 == 3)
            frame[7] = (uint8_t)(frame[1] + frame[2] + frame[3] + frame[4]);
        assert_as_reference(frame);
    }
}

static void bytes_stand_where_the_data_sheet_puts_them(void **state)
{
    (void)state;
    const uint8_t frame[8] = {0xFF, 0x34, 0x12, 0xCD, 0xAB, 0x00, 0x00, 0xBE};
    const struct sensor_reading reading = sensor_frame_decode(frame);
    assert_int_equal(reading.alpha, 0x1234);
    assert_int_equal(reading.beta, 0xABCD);
    assert_int_equal(reading.status, 0);
}

static void every_single_flipped_bit_of_a_clean_frame_is_noticed(void **state)
{
    (void)state;
    uint32_t random = 3;
    for (int i = 0; i < 200; i++) {
        const uint32_t angles = next_random(&random);
        for (unsigned bit = 0; bit < 64; bit++) {
            uint8_t frame[8];
            make_frame(angles & 0xFFFFu, angles >> 16, 0, frame);
            frame[bit / 8] ^= (uint8_t)(0x80u >> bit % 8);
            assert_int_not_equal(sensor_frame_decode(frame).status, 0);
            assert_as_reference(frame);
        }
    }
}

static void a_floating_line_is_absent_and_a_low_one_a_bad_start(void **state)
{
    (void)state;
    uint8_t frame[8];
    memset(frame, 0xFF, sizeof frame);
    assert_int_equal(sensor_frame_decode(frame).status >> 10, WHISKER_CODE_SENSOR_ABSENT);
    memset(frame, 0x00, sizeof frame);
    assert_int_equal(sensor_frame_decode(frame).status >> 10, WHISKER_CODE_SENSOR_START);
}

#define ROW(name, bit, sensor_bit, cause, remedy) {1u << (sensor_bit), 1u << (bit)},

static void each_error_bit_has_its_place_and_the_rest_have_none(void **state)
{
    (void)state;
    static const struct {
        uint16_t word, status;
    } rows[] = {WHISKER_SENSOR_ERRORS(ROW)};
    unsigned assigned = 0;
    for (unsigned i = 0; i < sizeof rows / sizeof *rows; i++) {
        assert_int_equal(sensor_frame_errors(rows[i].word), rows[i].status);
        assigned |= rows[i].word;
    }
    for (uint32_t word = 0; word <= 0xFFFF; word++)
        assert_int_equal(sensor_frame_errors((uint16_t)word), reference_errors((unsigned)word));
    assert_int_equal(assigned, 0x8BFC);
}

static void with_errors_set_either_coverage_of_the_sum_passes(void **state)
{
    (void)state;
    uint8_t frame[8];
    make_frame(0x8000, 0x7FF0, 0x0104, frame);
    assert_int_equal(sensor_frame_decode(frame).status, reference_errors(0x0104));
    frame[7] = (uint8_t)(frame[1] + frame[2] + frame[3] + frame[4]);
    assert_int_equal(sensor_frame_decode(frame).status, reference_errors(0x0104));
    frame[7] ^= 1;
    assert_int_equal(sensor_frame_decode(frame).status >> 10, WHISKER_CODE_SENSOR_SUM);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(good_frames_decode_as_the_reference),
        cmocka_unit_test(any_bytes_at_all_decode_as_the_reference),
        cmocka_unit_test(bytes_stand_where_the_data_sheet_puts_them),
        cmocka_unit_test(every_single_flipped_bit_of_a_clean_frame_is_noticed),
        cmocka_unit_test(a_floating_line_is_absent_and_a_low_one_a_bad_start),
        cmocka_unit_test(each_error_bit_has_its_place_and_the_rest_have_none),
        cmocka_unit_test(with_errors_set_either_coverage_of_the_sum_passes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
