/* The MLX90316's decoder against a reference of its own, which reads the frame as a string of bits. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <string.h>

#include "sensor_frame.h"

/* `width` bits from bit `first` of the frame, as they come down the line. */
static unsigned bits_of(const uint8_t frame[10], unsigned first, unsigned width)
{
    unsigned value = 0;
    for (unsigned i = first; i < first + width; i++)
        value = value << 1 | ((unsigned)frame[i / 8u] >> (7u - i % 8u) & 1u);
    return value;
}

/* Which bit of the status each bit of the error word sets: place of the table of the data sheet, bits 2 to 10. */
static unsigned reference_errors(unsigned word)
{
    static const int PLACE[16] = {-1, -1, 0, 1, 2, 5, 6, 3, -1, 7, 7, -1, -1, -1, -1, -1};
    unsigned errors = 0;
    for (unsigned bit = 0; bit < 16; bit++) {
        if (word >> bit & 1u && PLACE[bit] >= 0)
            errors |= 1u << PLACE[bit];
    }
    return errors;
}

static struct sensor_reading reference(const uint8_t frame[10])
{
    const struct sensor_reading none = {0, 0, 0};
    struct sensor_reading r = none;
    unsigned equal = 0, ones = 0;
    for (unsigned bit = 0; bit < 16; bit++) {
        const unsigned data = bits_of(frame, 16u + bit, 1), copy = bits_of(frame, 32u + bit, 1);
        equal += data == copy;
        ones += data + copy;
    }
    if (bits_of(frame, 0, 8) != 0xAA)
        r.status = WHISKER_CODE_SENSOR_START << WHISKER_STATUS_CODE_SHIFT;
    else if (ones == 32)
        r.status = WHISKER_CODE_SENSOR_ABSENT << WHISKER_STATUS_CODE_SHIFT;
    else if (equal > 0)
        r.status = WHISKER_CODE_SENSOR_SUM << WHISKER_STATUS_CODE_SHIFT;
    else if (bits_of(frame, 30, 2) == 1)
        r = (struct sensor_reading){(uint16_t)(bits_of(frame, 16, 14) << 2), 0x8000, 0};
    else if (bits_of(frame, 30, 2) == 2 && reference_errors(bits_of(frame, 16, 14) << 2) != 0)
        r = (struct sensor_reading){0x8000, 0x8000, (uint16_t)reference_errors(bits_of(frame, 16, 14) << 2)};
    else
        r.status = WHISKER_CODE_SENSOR_SUM << WHISKER_STATUS_CODE_SHIFT;
    return r;
}

static void assert_as_reference(const uint8_t frame[10])
{
    const struct sensor_reading is = sensor_frame_decode(frame), wanted = reference(frame);
    assert_int_equal(is.status, wanted.status);
    assert_int_equal(is.alpha, wanted.alpha);
    assert_int_equal(is.beta, wanted.beta);
}

static void make_frame(unsigned data, uint8_t frame[10])
{
    const uint8_t bytes[10] = {
        0xAA, 0xFF, (uint8_t)(data >> 8), (uint8_t)data, (uint8_t) ~(data >> 8), (uint8_t)~data, 0xFF, 0xFF,
        0xFF, 0xFF};
    memcpy(frame, bytes, sizeof bytes);
}

static void every_data_word_decodes_as_the_reference(void **state)
{
    uint8_t frame[10];
    (void)state;
    for (uint32_t data = 0; data <= 0xFFFFu; data++) {
        make_frame((unsigned)data, frame);
        assert_as_reference(frame);
    }
}

static void an_angle_is_its_upper_fourteen_bits(void **state)
{
    uint8_t frame[10];
    (void)state;
    make_frame(0x1234u << 2 | 1u, frame);
    const struct sensor_reading reading = sensor_frame_decode(frame);
    assert_int_equal(reading.alpha, 0x1234u << 2);
    assert_int_equal(reading.beta, 0x8000u);
    assert_int_equal(reading.status, 0);
}

static void no_flip_in_data_or_copy_makes_a_good_frame(void **state)
{
    uint8_t frame[10];
    (void)state;
    for (unsigned bit = 16; bit < 48; bit++) {
        for (unsigned angle = 1; angle < 0x4000u; angle += 97u) {
            make_frame(angle << 2 | 1u, frame);
            frame[bit / 8u] ^= (uint8_t)(0x80u >> bit % 8u);
            assert_int_equal(sensor_frame_decode(frame).status, WHISKER_CODE_SENSOR_SUM << WHISKER_STATUS_CODE_SHIFT);
        }
    }
}

static void any_bytes_at_all_decode_as_the_reference(void **state)
{
    uint32_t random = 1;
    uint8_t frame[10];
    (void)state;
    for (uint32_t i = 0; i < 60000u; i++) {
        for (unsigned b = 0; b < 10; b++) {
            random = random * UINT32_C(1664525) + UINT32_C(1013904223); /* Numerical Recipes */
            frame[b] = (uint8_t)(random >> 24);
        }
        frame[0] = i % 3u ? 0xAA : frame[0];
        if (i % 2u) {
            frame[4] = (uint8_t)~frame[2];
            frame[5] = (uint8_t)~frame[3];
        }
        assert_as_reference(frame);
    }
}

static void a_line_that_nobody_drives_is_absent_and_one_held_low_is_not_started(void **state)
{
    uint8_t frame[10];
    (void)state;
    memset(frame, 0xFF, sizeof frame);
    frame[0] = 0xAA; /* the master's own byte is on the shared line */
    assert_int_equal(sensor_frame_decode(frame).status >> WHISKER_STATUS_CODE_SHIFT, WHISKER_CODE_SENSOR_ABSENT);
    memset(frame, 0, sizeof frame);
    assert_int_equal(sensor_frame_decode(frame).status >> WHISKER_STATUS_CODE_SHIFT, WHISKER_CODE_SENSOR_START);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_data_word_decodes_as_the_reference),
        cmocka_unit_test(an_angle_is_its_upper_fourteen_bits),
        cmocka_unit_test(no_flip_in_data_or_copy_makes_a_good_frame),
        cmocka_unit_test(any_bytes_at_all_decode_as_the_reference),
        cmocka_unit_test(a_line_that_nobody_drives_is_absent_and_one_held_low_is_not_started),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
