/* Asking nodes: answers, patience, repetition, and what a control channel may do wrong. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "fake_nodes.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

#define ALL ((UINT32_C(1) << WHISKER_FRAME_LANES) - 1)

static struct whisker_answer answers[WHISKER_FRAME_LANES];

static int ask_chip(uint32_t lanes, unsigned patience)
{
    const struct whisker_service_order order = {.command = WHISKER_SERVICE_COMMAND_INFO};
    return whisker_service_ask(NULL, &order, lanes, patience, answers);
}

static void all_answer_one_order(void **state)
{
    (void)state;
    fake_nodes_reset(WHISKER_FRAME_LANES);
    assert_int_equal(ask_chip(ALL, 10), WHISKER_OK);
    for (int lane = 0; lane < WHISKER_FRAME_LANES; lane++) {
        assert_true(answers[lane].valid);
        assert_int_equal(answers[lane].alpha, WHISKER_LIMIT_CHIP_ID);
    }
    assert_int_equal(fakes.orders, 2); /* the order, and one look for its answers */
}

static void a_busy_node_is_asked_until_it_answers(void **state)
{
    (void)state;
    for (unsigned busy = 0; busy <= 30u; busy++) {
        fake_nodes_reset(3);
        fakes.node[1].busy = busy;
        assert_int_equal(ask_chip(7, WHISKER_LIMIT_BUSY_TICKS_MAX), WHISKER_OK);
        assert_true(answers[0].valid && answers[1].valid && answers[2].valid);
    }
}

static void a_node_silent_for_30_ms_still_answers(void **state)
{
    (void)state;
    fake_nodes_reset(2);
    fakes.node[0].busy = 60; /* ticks of 500 us */
    assert_int_equal(ask_chip(3, WHISKER_LIMIT_BUSY_TICKS_MAX), WHISKER_OK);
    assert_true(answers[0].valid && answers[1].valid);
}

static void patience_ends_without_an_error(void **state)
{
    (void)state;
    fake_nodes_reset(2);
    fakes.node[1].busy = 1000;
    assert_int_equal(ask_chip(3, 20), WHISKER_OK);
    assert_true(answers[0].valid);
    assert_false(answers[1].valid);
    assert_int_equal(fakes.orders, 20 + 20 / 4);
}

static void an_order_that_a_node_missed_is_sent_again(void **state)
{
    (void)state;
    fake_nodes_reset(1);
    fakes.node[0].busy = 1; /* over before the first look, so only a second order helps */
    assert_int_equal(ask_chip(1, 20), WHISKER_OK);
    assert_true(answers[0].valid);
    assert_int_equal(fakes.count_of[WHISKER_SERVICE_COMMAND_INFO], 2);
}

static void lanes_that_are_not_asked_for_are_not_waited_for(void **state)
{
    (void)state;
    fake_nodes_reset(2);
    fakes.node[1].busy = 1000;
    assert_int_equal(ask_chip(1, 20), WHISKER_OK);
    assert_int_equal(fakes.orders, 2);
}

static void an_answer_to_another_order_is_none(void **state)
{
    (void)state;
    fake_nodes_reset(2);
    fakes.node[1].answering = true; /* to an order of long ago, and it hears no other */
    fakes.node[1].command = WHISKER_SERVICE_COMMAND_BLOCK;
    fakes.node[1].lose_percent = 100;
    assert_int_equal(ask_chip(3, 20), WHISKER_OK);
    assert_true(answers[0].valid);
    assert_false(answers[1].valid);
}

static void the_first_answer_stands(void **state)
{
    (void)state;
    fake_nodes_reset(2);
    fakes.node[1].busy = 12;
    fakes.node[0].stays_for = 3; /* gone after its first answer, which a later look must not take back */
    assert_int_equal(ask_chip(3, 40), WHISKER_OK);
    assert_true(answers[0].valid && answers[1].valid);
    assert_int_equal(answers[0].status,
                     WHISKER_CODE_ANSWER << WHISKER_STATUS_CODE_SHIFT | WHISKER_SERVICE_COMMAND_INFO);
}

static void ticks_that_do_not_run_are_reported(void **state)
{
    (void)state;
    fake_nodes_reset(1);
    fakes.ticks_stopped = true;
    assert_int_equal(ask_chip(1, 20), WHISKER_ERROR_TIMEOUT);
    assert_int_equal(fakes.ticks, 4000);
}

static void errors_of_the_channel_are_passed_on(void **state)
{
    (void)state;
    fake_nodes_reset(1);
    fakes.fail_after = 0;
    fakes.send_error = WHISKER_ERROR_DEVICE_REFUSED;
    assert_int_equal(ask_chip(1, 20), WHISKER_ERROR_DEVICE_REFUSED);
    fakes.send_error = WHISKER_OK;
    fakes.poll_error = WHISKER_ERROR_DEVICE_GONE;
    assert_int_equal(ask_chip(1, 20), WHISKER_ERROR_DEVICE_GONE);
    fakes.poll_error = WHISKER_OK;
    fakes.answers_error = WHISKER_ERROR_DEVICE_CONTROL;
    assert_int_equal(ask_chip(1, 20), WHISKER_ERROR_DEVICE_CONTROL);
}

static void nodes_report_who_they_are(void **state)
{
    (void)state;
    struct whisker_node nodes[WHISKER_FRAME_LANES];
    fake_nodes_reset(2);
    fakes.node[1].serial = 0xDEADBEEF;
    fakes.node[1].firmware = 0x0305;
    fakes.node[1].options = 0x8001;
    fakes.node[1].loader = 7;
    fakes.node[1].chip = 0x062A;
    fakes.node[1].state = WHISKER_NODE_STATE_LOADER;
    assert_int_equal(whisker_nodes_identify(NULL, ALL, nodes), WHISKER_OK);
    assert_true(nodes[0].present && nodes[1].present && !nodes[2].present);
    assert_int_equal(nodes[0].serial, 1);
    assert_int_equal(nodes[1].serial, 0xDEADBEEF);
    assert_int_equal(nodes[1].firmware, 0x0305);
    assert_int_equal(nodes[1].options, 0x8001);
    assert_int_equal(nodes[1].loader, 7);
    assert_int_equal(nodes[1].chip, 0x062A);
    assert_int_equal(nodes[1].wire_version, WHISKER_WIRE_VERSION);
    assert_int_equal(nodes[1].state, WHISKER_NODE_STATE_LOADER);
}

static void empty_lanes_are_waited_for_once(void **state)
{
    (void)state;
    struct whisker_node nodes[WHISKER_FRAME_LANES];
    fake_nodes_reset(1);
    assert_int_equal(whisker_nodes_identify(NULL, ALL, nodes), WHISKER_OK);
    const unsigned first = WHISKER_LIMIT_BUSY_TICKS_MAX + WHISKER_LIMIT_BUSY_TICKS_MAX / 4;
    assert_int_equal(fakes.orders, first + 3 * 2);
}

static void a_node_that_goes_silent_while_it_reports_is_not_present(void **state)
{
    (void)state;
    struct whisker_node nodes[WHISKER_FRAME_LANES];
    fake_nodes_reset(2);
    fakes.node[1].lose_percent = 60; /* slow, but there */
    assert_int_equal(whisker_nodes_identify(NULL, 3, nodes), WHISKER_OK);
    assert_true(nodes[0].present && nodes[1].present);
    fake_nodes_reset(2);
    fakes.node[1].there = false;
    assert_int_equal(whisker_nodes_identify(NULL, 3, nodes), WHISKER_OK);
    assert_false(nodes[1].present);
}

static void counters_are_those_asked_for(void **state)
{
    (void)state;
    uint16_t counts[WHISKER_FRAME_LANES];
    fake_nodes_reset(2);
    fakes.node[0].health[WHISKER_HEALTH_OVERRUN] = 65535;
    fakes.node[1].health[WHISKER_HEALTH_SENSOR_SUM] = 5;
    assert_int_equal(whisker_nodes_health(NULL, 7, WHISKER_HEALTH_OVERRUN, counts), WHISKER_OK);
    assert_int_equal(counts[0], 65535);
    assert_int_equal(counts[1], 0);
    assert_int_equal(counts[2], 0); /* nobody there */
    assert_int_equal(whisker_nodes_health(NULL, 7, WHISKER_HEALTH_SENSOR_SUM, counts), WHISKER_OK);
    assert_int_equal(counts[1], 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_answer_one_order),
        cmocka_unit_test(a_busy_node_is_asked_until_it_answers),
        cmocka_unit_test(a_node_silent_for_30_ms_still_answers),
        cmocka_unit_test(patience_ends_without_an_error),
        cmocka_unit_test(an_order_that_a_node_missed_is_sent_again),
        cmocka_unit_test(lanes_that_are_not_asked_for_are_not_waited_for),
        cmocka_unit_test(an_answer_to_another_order_is_none),
        cmocka_unit_test(the_first_answer_stands),
        cmocka_unit_test(ticks_that_do_not_run_are_reported),
        cmocka_unit_test(errors_of_the_channel_are_passed_on),
        cmocka_unit_test(nodes_report_who_they_are),
        cmocka_unit_test(empty_lanes_are_waited_for_once),
        cmocka_unit_test(a_node_that_goes_silent_while_it_reports_is_not_present),
        cmocka_unit_test(counters_are_those_asked_for),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
