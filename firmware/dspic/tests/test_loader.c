/* The boot loader's part that knows no register: orders in, flash and states out. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <string.h>

#include "boot/loader.h"
#include "flash_board.h"
#include "orders.h"

static struct loader loader;
static struct service service;
static uint8_t header[WHISKER_IMAGE_HEADER_BYTES];
static uint8_t scratch[WHISKER_LIMIT_FLASH_ROW_BYTES];

static void begin_test(void)
{
    flash_board_reset();
    header_make(header);
    service_start(&service);
    loader_start(&loader, &flash_board);
}

static void order(uint8_t command, uint32_t argument, const uint8_t *data)
{
    uint8_t bytes[WHISKER_SERVICE_BYTES];
    uint16_t words[SERVICE_WORDS];
    order_of(bytes, 1, command, argument, data);
    words_of(bytes, words);
    service_take(&service, words);
    loader_serve(&loader, &service);
    assert_false(service.waiting);
}

static void send_block(uint16_t number)
{
    uint8_t data[SERVICE_BLOCK_BYTES];
    for (uint16_t i = 0; i < SERVICE_BLOCK_BYTES; i++)
        data[i] = body_byte((uint16_t)(number * SERVICE_BLOCK_BYTES + i));
    order(WHISKER_SERVICE_COMMAND_BLOCK, number, data);
}

static void send_blocks(uint16_t from, uint16_t to)
{
    for (uint16_t number = from; number < to; number++)
        send_block(number);
}

static void assert_answer(uint16_t alpha, uint16_t beta)
{
    assert_int_equal(service.alpha, alpha);
    assert_int_equal(service.beta, beta);
}

static void an_image_is_taken_block_by_block_and_runs(void **state)
{
    (void)state;
    begin_test();
    order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
    assert_answer(0, WHISKER_NODE_STATE_LOADING);
    for (uint16_t number = 0; number < BODY_BLOCKS; number++) {
        send_block(number);
        assert_answer((uint16_t)(number + 1u), WHISKER_NODE_STATE_LOADING);
        assert_false(image_is_valid(&flash_board, scratch)); /* its header comes last */
    }
    order(WHISKER_SERVICE_COMMAND_FINISH, 0, NULL);
    assert_answer(BODY_BLOCKS, WHISKER_NODE_STATE_COMPLETE);
    assert_true(image_is_valid(&flash_board, scratch));
    assert_int_equal(flash_board.erased, 3); /* the header's page, and two that the body reaches into */
    assert_int_equal(flash_board.written, BODY_ROWS + 1);
    order(WHISKER_SERVICE_COMMAND_RUN, 0, NULL);
    assert_true(flash_board.runs);
}

static void begin_forgets_the_old_application_first(void **state)
{
    (void)state;
    begin_test();
    flash_board_program(header);
    assert_true(image_is_valid(&flash_board, scratch));
    header[WHISKER_IMAGE_HEADER_VERSION]++;
    header_seal(header);
    order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
    assert_false(image_is_valid(&flash_board, scratch));
}

static void blocks_out_of_turn_are_ignored(void **state)
{
    (void)state;
    begin_test();
    send_block(0); /* before begin */
    assert_answer(0, WHISKER_NODE_STATE_LOADER);
    order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
    send_block(1);
    assert_answer(0, WHISKER_NODE_STATE_LOADING);
    send_blocks(0, 3);
    send_block(1);
    assert_answer(3, WHISKER_NODE_STATE_LOADING);
    send_blocks(3, BODY_BLOCKS);
    send_block(BODY_BLOCKS);
    assert_answer(BODY_BLOCKS, WHISKER_NODE_STATE_LOADING);
    order(WHISKER_SERVICE_COMMAND_FINISH, 0, NULL);
    assert_answer(BODY_BLOCKS, WHISKER_NODE_STATE_COMPLETE);
}

static void the_same_header_again_goes_on_another_begins_anew(void **state)
{
    (void)state;
    begin_test();
    order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
    send_blocks(0, 10);
    order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
    assert_answer(10, WHISKER_NODE_STATE_LOADING);
    header[WHISKER_IMAGE_HEADER_VERSION]++;
    header_seal(header);
    order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
    assert_answer(0, WHISKER_NODE_STATE_LOADING);
}

static void what_is_refused_leaves_the_application_as_it_is(void **state)
{
    (void)state;
    begin_test();
    flash_board_program(header);
    order(WHISKER_SERVICE_COMMAND_BEGIN, 6, header);
    assert_answer(0, WHISKER_NODE_STATE_NOT_ADDRESSED);
    flash_board.chip++;
    order(WHISKER_SERVICE_COMMAND_BEGIN, 5, header);
    assert_answer(0, WHISKER_NODE_STATE_OTHER_CHIP);
    flash_board.chip--;
    header[0] ^= 1u;
    order(WHISKER_SERVICE_COMMAND_BEGIN, 5, header);
    assert_answer(0, WHISKER_NODE_STATE_BAD_HEADER);
    assert_int_equal(flash_board.erased, 0);
    order(WHISKER_SERVICE_COMMAND_RUN, 6, NULL);
    assert_false(flash_board.runs); /* it was another's */
    order(WHISKER_SERVICE_COMMAND_RUN, 5, NULL);
    assert_true(flash_board.runs);
}

static void a_wrong_body_is_reported_and_does_not_run(void **state)
{
    (void)state;
    begin_test();
    header[WHISKER_IMAGE_HEADER_BODY_CRC32] ^= 1u;
    header_seal(header);
    order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
    send_blocks(0, BODY_BLOCKS);
    order(WHISKER_SERVICE_COMMAND_FINISH, 0, NULL);
    assert_answer(BODY_BLOCKS, WHISKER_NODE_STATE_BAD_IMAGE);
    order(WHISKER_SERVICE_COMMAND_RUN, 0, NULL);
    assert_false(flash_board.runs);
}

static void an_unfinished_image_neither_ends_nor_runs(void **state)
{
    (void)state;
    begin_test();
    order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
    send_blocks(0, BODY_BLOCKS - 1);
    order(WHISKER_SERVICE_COMMAND_FINISH, 0, NULL);
    assert_answer(BODY_BLOCKS - 1, WHISKER_NODE_STATE_LOADING);
    order(WHISKER_SERVICE_COMMAND_RUN, 0, NULL);
    assert_false(flash_board.runs);
}

static void flash_that_does_not_hold_is_reported_at_once(void **state)
{
    (void)state;
    for (uint16_t row = WHISKER_LIMIT_APPLICATION_ROW + 1u; row <= WHISKER_LIMIT_APPLICATION_ROW + BODY_ROWS; row++) {
        begin_test();
        flash_board.sticks = row;
        order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
        const uint16_t last = (uint16_t)((row - IMAGE_FIRST_ROW) * 4u + 3u);
        send_blocks(0, last);
        assert_answer(last, WHISKER_NODE_STATE_LOADING);
        send_block(last);
        assert_answer((uint16_t)(last + 1u), WHISKER_NODE_STATE_FLASH_FAILED);
    }
}

static void questions_do_not_disturb_a_row_being_gathered(void **state)
{
    (void)state;
    begin_test();
    order(WHISKER_SERVICE_COMMAND_BEGIN, 0, header);
    for (uint16_t number = 0; number < BODY_BLOCKS; number++) {
        send_block(number);
        order(WHISKER_SERVICE_COMMAND_INFO, number % 5u, NULL);
        order(WHISKER_SERVICE_COMMAND_POLL, 0, NULL);
    }
    order(WHISKER_SERVICE_COMMAND_FINISH, 0, NULL);
    assert_answer(BODY_BLOCKS, WHISKER_NODE_STATE_COMPLETE);
}

static void it_reports_who_it_is(void **state)
{
    (void)state;
    begin_test();
    flash_board.serial = UINT32_C(0xDEADBEEF);
    order(WHISKER_SERVICE_COMMAND_INFO, WHISKER_INFO_SERIAL, NULL);
    assert_answer(0xBEEF, 0xDEAD);
    order(WHISKER_SERVICE_COMMAND_INFO, WHISKER_INFO_CHIP, NULL);
    assert_answer(WHISKER_LIMIT_CHIP_ID, WHISKER_NODE_STATE_LOADER);
    order(WHISKER_SERVICE_COMMAND_INFO, WHISKER_INFO_WIRE, NULL);
    assert_answer(WHISKER_WIRE_VERSION, LOADER_VERSION);
    flash_board_program(header);
    order(WHISKER_SERVICE_COMMAND_INFO, WHISKER_INFO_FIRMWARE, NULL);
    assert_answer(0x0203, 0x8001);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_image_is_taken_block_by_block_and_runs),
        cmocka_unit_test(begin_forgets_the_old_application_first),
        cmocka_unit_test(blocks_out_of_turn_are_ignored),
        cmocka_unit_test(the_same_header_again_goes_on_another_begins_anew),
        cmocka_unit_test(what_is_refused_leaves_the_application_as_it_is),
        cmocka_unit_test(a_wrong_body_is_reported_and_does_not_run),
        cmocka_unit_test(an_unfinished_image_neither_ends_nor_runs),
        cmocka_unit_test(flash_that_does_not_hold_is_reported_at_once),
        cmocka_unit_test(questions_do_not_disturb_a_row_being_gathered),
        cmocka_unit_test(it_reports_who_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
