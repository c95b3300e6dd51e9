/* May an image be loaded, may an application run? */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <string.h>

#include "flash_board.h"

static uint8_t header[WHISKER_IMAGE_HEADER_BYTES];
static uint8_t row[WHISKER_LIMIT_FLASH_ROW_BYTES];

static uint8_t judged(void)
{
    header_seal(header);
    return image_judge(header, WHISKER_LIMIT_CHIP_ID);
}

static void a_sound_header_may_be_loaded(void **state)
{
    (void)state;
    header_make(header);
    assert_int_equal(image_judge(header, WHISKER_LIMIT_CHIP_ID), WHISKER_NODE_STATE_LOADING);
    assert_int_equal(image_rows(header), BODY_ROWS);
}

static void a_header_with_any_bit_flipped_is_bad(void **state)
{
    (void)state;
    header_make(header);
    for (uint16_t bit = 0; bit < 8u * WHISKER_IMAGE_HEADER_BYTES; bit++) {
        header[bit / 8u] ^= (uint8_t)(1u << bit % 8u);
        assert_int_equal(image_judge(header, WHISKER_LIMIT_CHIP_ID), WHISKER_NODE_STATE_BAD_HEADER);
        header[bit / 8u] ^= (uint8_t)(1u << bit % 8u);
    }
}

static void magic_format_and_place_must_be_right(void **state)
{
    (void)state;
    header_make(header);
    header[WHISKER_IMAGE_HEADER_MAGIC] ^= 1u;
    assert_int_equal(judged(), WHISKER_NODE_STATE_BAD_HEADER);
    header_make(header);
    header[WHISKER_IMAGE_HEADER_FORMAT]++;
    assert_int_equal(judged(), WHISKER_NODE_STATE_BAD_HEADER);
    header_make(header);
    whisker_put_u16(header + WHISKER_IMAGE_HEADER_FIRST_ROW, WHISKER_LIMIT_APPLICATION_ROW);
    assert_int_equal(judged(), WHISKER_NODE_STATE_BAD_HEADER);
}

static void another_chip_and_an_older_wire_are_refused_a_newer_is_not(void **state)
{
    (void)state;
    header_make(header);
    assert_int_equal(image_judge(header, WHISKER_LIMIT_CHIP_ID + 1u), WHISKER_NODE_STATE_OTHER_CHIP);
    header[WHISKER_IMAGE_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION - 1;
    assert_int_equal(judged(), WHISKER_NODE_STATE_OLD_WIRE);
    header[WHISKER_IMAGE_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION + 1;
    assert_int_equal(judged(), WHISKER_NODE_STATE_LOADING);
}

/* Lengths beyond 16 bits: what counts rows must not lose their high half. */
static void a_length_is_whole_rows_that_fit(void **state)
{
    (void)state;
    static const struct {
        uint32_t length;
        uint16_t rows;
    } CASES[] = {{0, 0},
                 {191, 0},
                 {192, 1},
                 {193, 0},
                 {65472, 341},
                 {65536, 0},
                 {65664, 342},
                 {UINT32_C(192) * IMAGE_ROWS_MAX, IMAGE_ROWS_MAX},
                 {UINT32_C(192) * (IMAGE_ROWS_MAX + 1u), 0},
                 {UINT32_C(0x00030000), 0},
                 {UINT32_C(0xFFFFFF00), 0}};
    for (uint8_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        header_make(header);
        whisker_put_u32(header + WHISKER_IMAGE_HEADER_LENGTH, CASES[i].length);
        assert_int_equal(image_rows(header), CASES[i].rows);
        assert_int_equal(judged(), CASES[i].rows ? WHISKER_NODE_STATE_LOADING : WHISKER_NODE_STATE_BAD_HEADER);
    }
}

static void an_application_may_run_if_header_and_body_are_right(void **state)
{
    (void)state;
    flash_board_reset();
    assert_false(image_is_valid(&flash_board, row));
    header_make(header);
    flash_board_program(header);
    assert_true(image_is_valid(&flash_board, row));
    assert_int_equal(flash_board.alive, BODY_ROWS); /* the watchdog hears of every row */
    flash_board.chip++;
    assert_false(image_is_valid(&flash_board, row));
}

static void one_wrong_bit_of_the_body_is_enough(void **state)
{
    (void)state;
    flash_board_reset();
    header_make(header);
    flash_board_program(header);
    for (uint16_t i = 0; i < BODY_BYTES; i = (uint16_t)(i + 97u)) {
        uint8_t *byte = &flash_board.row[1u + i / WHISKER_LIMIT_FLASH_ROW_BYTES][i % WHISKER_LIMIT_FLASH_ROW_BYTES];
        *byte ^= (uint8_t)(1u << i % 8u);
        assert_false(image_body_is_good(&flash_board, header, row));
        *byte ^= (uint8_t)(1u << i % 8u);
    }
    assert_true(image_body_is_good(&flash_board, header, row));
}

static void version_and_options_are_reported_of_a_sound_header_only(void **state)
{
    (void)state;
    uint16_t version, options;
    flash_board_reset();
    assert_false(image_version(&flash_board, row, &version, &options));
    assert_int_equal(version | options, 0);
    header_make(header);
    flash_board_program(header);
    assert_true(image_version(&flash_board, row, &version, &options));
    assert_int_equal(version, 0x0203);
    assert_int_equal(options, 0x8001);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sound_header_may_be_loaded),
        cmocka_unit_test(a_header_with_any_bit_flipped_is_bad),
        cmocka_unit_test(magic_format_and_place_must_be_right),
        cmocka_unit_test(another_chip_and_an_older_wire_are_refused_a_newer_is_not),
        cmocka_unit_test(a_length_is_whole_rows_that_fit),
        cmocka_unit_test(an_application_may_run_if_header_and_body_are_right),
        cmocka_unit_test(one_wrong_bit_of_the_body_is_enough),
        cmocka_unit_test(version_and_options_are_reported_of_a_sound_header_only),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
