/* The sampler on a board that only notes what it is asked: each test delivers the events by hand. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "board/sensor.h"
#include "board/timer.h"
#include "sampler.h"
#include "whisker_protocol.h"

struct board {
    unsigned select; /* level */
    unsigned select_edges, transfers;
    unsigned timer_us; /* 0 when the timer does not run */
};

void board_sensor_select(struct board *board, bool level)
{
    board->select_edges += level != board->select;
    board->select = level;
}

void board_sensor_transfer(struct board *board, uint8_t byte)
{
    assert_int_equal(byte, 0xFF);
    assert_false(board->select);
    board->transfers++;
}

void board_timer_start(struct board *board, uint16_t us)
{
    board->timer_us = us;
}

struct bench {
    struct board board;
    struct sampler sampler;
    struct sensor_reading reading;
};

static void reset(struct bench *bench)
{
    const struct board board = {.select = 1};
    bench->board = board;
    sampler_start(&bench->sampler, &bench->board, WHISKER_CODE_STARTING);
}

/* Lets the timer elapse; returns how long it ran. */
static unsigned elapse(struct bench *bench)
{
    const unsigned us = bench->board.timer_us;
    assert_true(us > 0);
    bench->board.timer_us = 0;
    sampler_on_timer(&bench->sampler);
    return us;
}

static void make_ready(struct bench *bench)
{
    reset(bench);
    while (!sampler_ready(&bench->sampler))
        elapse(bench);
}

static const uint8_t GOOD[8] = {0xFF, 0x10, 0x80, 0x20, 0x70, 0x00, 0x00, 0x20};

/* Delivers byte `i`; `damage` is xored into it. */
static bool deliver(struct bench *bench, unsigned i, uint8_t damage)
{
    return sampler_on_byte(&bench->sampler, GOOD[i] ^ damage, &bench->reading);
}

/* Delivers the first `events` of a reading's fifteen: byte, gap, byte, ... */
static void advance(struct bench *bench, unsigned events)
{
    for (unsigned i = 0; i < events; i++) {
        if (i % 2 == 0)
            assert_int_equal(deliver(bench, i / 2, 0), i == 14);
        else
            elapse(bench);
    }
}

/* From a frame given up to the next possible reading: the waits and the levels of /SS during them. */
static void assert_resynchronises(struct bench *bench, unsigned least_us)
{
    assert_false(bench->board.select);
    assert_true(elapse(bench) >= least_us);
    assert_true(bench->board.select);
    assert_in_range(elapse(bench), 330, 400); /* t5 of a part with a 10 % slow oscillator; ready before the next SYNC */
    assert_false(bench->board.select);
    assert_false(sampler_ready(&bench->sampler));
    assert_true(elapse(bench) >= 3); /* t6 */
    assert_true(sampler_ready(&bench->sampler));
    assert_int_equal(bench->board.timer_us, 0);
}

static void start_up_waits_then_resynchronises(void **state)
{
    (void)state;
    struct bench bench;
    reset(&bench);
    assert_in_range(elapse(&bench), 17600, 19500); /* STARTING's remedy promises 20 ms in all */
    assert_true(bench.board.select);
    assert_true(elapse(&bench) >= 330);
    assert_false(bench.board.select);
    assert_true(elapse(&bench) >= 3);
    assert_true(sampler_ready(&bench.sampler));
    assert_int_equal(bench.board.transfers, 0);
}

static void syncs_before_that_report_starting_and_disturb_nothing(void **state)
{
    (void)state;
    struct bench bench;
    reset(&bench);
    for (unsigned stage = 0; stage < 3; stage++) {
        const struct board before = bench.board;
        assert_int_equal(sampler_on_sync(&bench.sampler), WHISKER_CODE_STARTING);
        assert_memory_equal(&before, &bench.board, sizeof before);
        elapse(&bench);
    }
    assert_int_equal(sampler_on_sync(&bench.sampler), WHISKER_CODE_LATE);
    assert_int_equal(bench.board.transfers, 1);
}

static void a_gap_from_the_timer_follows_every_byte_but_the_last(void **state)
{
    (void)state;
    struct bench bench;
    make_ready(&bench);
    sampler_on_sync(&bench.sampler);
    for (unsigned i = 0; i < 7; i++) {
        assert_int_equal(bench.board.transfers, i + 1);
        assert_false(deliver(&bench, i, 0));
        assert_int_equal(bench.board.transfers, i + 1); /* nothing before the timer */
        assert_in_range(elapse(&bench), 17, 35);        /* t7 with margin; 35 would make the frame 413 us */
    }
    assert_true(deliver(&bench, 7, 0));
    assert_int_equal(bench.reading.alpha, 0x8010);
    assert_int_equal(bench.reading.beta, 0x7020);
    assert_int_equal(bench.reading.status, 0);
    assert_int_equal(bench.board.timer_us, 0);
}

static void good_frames_follow_each_other_with_select_low(void **state)
{
    (void)state;
    struct bench bench;
    make_ready(&bench);
    const unsigned edges = bench.board.select_edges;
    for (unsigned n = 0; n < 300; n++) {
        assert_int_equal(sampler_on_sync(&bench.sampler), WHISKER_CODE_LATE);
        advance(&bench, 15);
        assert_true(sampler_ready(&bench.sampler));
    }
    assert_int_equal(bench.board.select_edges, edges);
}

static void a_bad_frame_resynchronises_once(void **state)
{
    (void)state;
    for (unsigned bad = 0; bad < 5; bad++) {
        struct bench bench;
        make_ready(&bench);
        sampler_on_sync(&bench.sampler);
        for (unsigned i = 0; i < 8; i++) {
            if (i > 0)
                elapse(&bench);
            assert_int_equal(deliver(&bench, i, i == bad ? 0x40 : 0), i == 7);
        }
        assert_int_equal(bench.reading.status >> 10, bad == 0 ? WHISKER_CODE_SENSOR_START : WHISKER_CODE_SENSOR_SUM);
        assert_resynchronises(&bench, 3);
    }
}

static void a_sync_at_any_moment_of_a_resynchronisation_reports_it_and_disturbs_nothing(void **state)
{
    (void)state;
    struct bench bench;
    make_ready(&bench);
    sampler_on_sync(&bench.sampler);
    advance(&bench, 14);
    deliver(&bench, 7, 1);
    while (!sampler_ready(&bench.sampler)) {
        const struct board before = bench.board;
        assert_int_equal(sampler_on_sync(&bench.sampler), WHISKER_CODE_RESYNC);
        assert_memory_equal(&before, &bench.board, sizeof before);
        elapse(&bench);
    }
}

static void a_sync_at_any_moment_of_a_reading_gives_it_up_and_resynchronises(void **state)
{
    (void)state;
    for (unsigned events = 0; events < 15; events++) {
        struct bench bench;
        make_ready(&bench);
        sampler_on_sync(&bench.sampler);
        advance(&bench, events);
        const unsigned transfers = bench.board.transfers;
        assert_int_equal(sampler_on_sync(&bench.sampler), WHISKER_CODE_RESYNC);
        assert_false(deliver(&bench, 7, 0));                         /* the byte under way ends and is dropped */
        assert_resynchronises(&bench, BOARD_SENSOR_BYTE_MAX_US + 3); /* a byte under way, then t4 */
        assert_int_equal(bench.board.transfers, transfers);
        assert_int_equal(sampler_on_sync(&bench.sampler), WHISKER_CODE_LATE);
        advance(&bench, 15);
        assert_int_equal(bench.reading.status, 0);
    }
}

/* Reads a frame with this alpha; returns the record's code. */
static unsigned read_alpha(struct bench *bench, uint16_t alpha)
{
    const uint8_t low = (uint8_t)alpha, high = (uint8_t)(alpha >> 8);
    const uint8_t frame[8] = {0xFF, low, high, 0x20, 0x70, 0, 0, (uint8_t)(low + high + 0x90)};
    sampler_on_sync(&bench->sampler);
    for (unsigned i = 0; i < 8; i++) {
        if (i > 0)
            elapse(bench);
        sampler_on_byte(&bench->sampler, frame[i], &bench->reading);
    }
    return bench->reading.status >> WHISKER_STATUS_CODE_SHIFT;
}

static void a_jump_is_not_believed_until_the_sensor_was_resynchronised(void **state)
{
    (void)state;
    struct bench bench;
    make_ready(&bench);
    assert_int_equal(read_alpha(&bench, 0x8000), WHISKER_CODE_OK);
    assert_int_equal(read_alpha(&bench, 0x9000), WHISKER_CODE_OK); /* 11 degrees */
    assert_int_equal(read_alpha(&bench, 0xC000), WHISKER_CODE_STEP);
    assert_int_equal(bench.reading.alpha, 0);
    assert_resynchronises(&bench, 3);
    assert_int_equal(read_alpha(&bench, 0xC000), WHISKER_CODE_OK);
    assert_int_equal(read_alpha(&bench, 0x8000), WHISKER_CODE_STEP);
}

static void until_ready_ticks_report_the_kind_of_reset(void **state)
{
    (void)state;
    struct bench bench;
    reset(&bench);
    sampler_start(&bench.sampler, &bench.board, WHISKER_CODE_RESET_WATCHDOG);
    assert_int_equal(sampler_on_sync(&bench.sampler), WHISKER_CODE_RESET_WATCHDOG);
    while (!sampler_ready(&bench.sampler))
        elapse(&bench);
    assert_int_equal(sampler_on_sync(&bench.sampler), WHISKER_CODE_LATE);
}

static void events_nobody_asked_for_are_ignored(void **state)
{
    (void)state;
    struct bench bench;
    make_ready(&bench);
    const struct board idle = bench.board;
    sampler_on_timer(&bench.sampler);
    assert_false(deliver(&bench, 0, 0));
    assert_memory_equal(&idle, &bench.board, sizeof idle);
    sampler_on_sync(&bench.sampler);
    sampler_on_timer(&bench.sampler);
    assert_int_equal(bench.board.transfers, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(start_up_waits_then_resynchronises),
        cmocka_unit_test(syncs_before_that_report_starting_and_disturb_nothing),
        cmocka_unit_test(a_gap_from_the_timer_follows_every_byte_but_the_last),
        cmocka_unit_test(good_frames_follow_each_other_with_select_low),
        cmocka_unit_test(a_bad_frame_resynchronises_once),
        cmocka_unit_test(a_sync_at_any_moment_of_a_resynchronisation_reports_it_and_disturbs_nothing),
        cmocka_unit_test(a_sync_at_any_moment_of_a_reading_gives_it_up_and_resynchronises),
        cmocka_unit_test(a_jump_is_not_believed_until_the_sensor_was_resynchronised),
        cmocka_unit_test(until_ready_ticks_report_the_kind_of_reset),
        cmocka_unit_test(events_nobody_asked_for_are_ignored),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
