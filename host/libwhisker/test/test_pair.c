/* Two bridges' frames in one row: whatever comes first, and whatever is lost. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "whisker/errors.h"
#include "whisker/pair.h"

#define KNOWN 0x8000u
#define OUT 2048
#define PERIOD 30000u

static struct whisker_pair pair;
static struct whisker_frame out[OUT];
static size_t made;

static int begin(void **state)
{
    (void)state;
    whisker_pair_init(&pair, PERIOD);
    made = 0;
    return 0;
}

static void collect(void)
{
    for (int got; (got = whisker_pair_next(&pair, &out[made])) > 0;) {
        made += (size_t)got;
    }
}

/* A frame of a tick whose SYNC came in this microframe. */
static void add_at(int bridge, uint64_t tick, unsigned microframe)
{
    struct whisker_frame frame = {
        .tick = tick, .time_cycles = tick * PERIOD, .sequence = 77, .lane_mask = bridge ? 2 : 1};
    frame.flags = (KNOWN | (microframe & 0x3FFFu)) << WHISKER_FRAME_USB_TIME_SHIFT;
    assert_int_equal(whisker_pair_add(&pair, bridge, &frame), 0);
    collect();
}

static void add(int bridge, uint64_t tick)
{
    add_at(bridge, tick, (unsigned)(4 * tick));
}

/* Frame i of the row is of this bridge and tick. */
static void assert_is(size_t i, int bridge, uint64_t tick)
{
    assert_true(i < made);
    assert_int_equal(out[i].tick, tick);
    assert_int_equal(out[i].time_cycles, tick * PERIOD);
    assert_int_equal(out[i].lane_mask, bridge ? 2 : 1);
    assert_int_equal(out[i].flags & WHISKER_FRAME_SECOND, bridge ? WHISKER_FRAME_SECOND : 0);
    assert_int_equal(out[i].sequence, 2 * tick + (uint64_t)bridge);
}

static void frames_go_in_pairs_whichever_comes_first(void **state)
{
    (void)state;
    for (uint64_t tick = 0; tick < 40; tick += 4) { /* batches of four, in turns */
        for (int turn = 0; turn < 2; turn++) {
            for (uint64_t i = 0; i < 4; i++) {
                add((int)(tick / 4 + (uint64_t)turn) % 2, tick + i);
            }
        }
    }
    assert_int_equal(made, 80);
    for (size_t i = 0; i < made; i++) {
        assert_is(i, i % 2, i / 2);
    }
    assert_int_equal(pair.counts.paired, 40);
    assert_int_equal(pair.counts.alone[0] + pair.counts.alone[1] + pair.counts.apart, 0);
}

static void a_lost_frame_leaves_the_other_alone(void **state)
{
    (void)state;
    static const int lost_of[] = {-1, 0, -1, 1, 1, -1};
    for (uint64_t tick = 0; tick < 6; tick++) {
        for (int bridge = 0; bridge < 2; bridge++) {
            if (lost_of[tick] != bridge) {
                add(bridge, tick);
            }
        }
    }
    const struct {
        int bridge;
        uint64_t tick;
    } wanted[] = {{0, 0}, {1, 0}, {1, 1}, {0, 2}, {1, 2}, {0, 3}, {0, 4}, {0, 5}, {1, 5}};
    assert_int_equal(made, 9);
    for (size_t i = 0; i < made; i++) {
        assert_is(i, wanted[i].bridge, wanted[i].tick);
    }
    assert_int_equal(pair.counts.alone[0], 2);
    assert_int_equal(pair.counts.alone[1], 1);
}

static void a_silent_bridge_holds_the_other_up_for_a_while_only(void **state)
{
    (void)state;
    for (uint64_t tick = 0; tick < WHISKER_PAIR_HELD + 5; tick++) {
        add(1, tick);
        assert_int_equal(made, tick + 1 < WHISKER_PAIR_HELD ? 0 : tick + 1);
    }
    whisker_pair_run(&pair, 0, false);
    collect();
    assert_int_equal(made, WHISKER_PAIR_HELD + 5);
    add(1, made);
    assert_int_equal(made, WHISKER_PAIR_HELD + 6); /* it no longer waits */
    for (size_t i = 0; i < made; i++) {
        assert_is(i, 1, i);
    }
}

/* The second bridge's ticks are numbered so much lower than the first's of the same moment. */
static void add_both(uint64_t from, uint64_t count, uint64_t lower)
{
    for (uint64_t tick = from; tick < from + count; tick++) {
        add(0, tick);
        add_at(1, tick - lower, (unsigned)(4 * tick) + tick % 2); /* at times in the next microframe */
    }
}

static void assert_pairs(size_t at, uint64_t from, uint64_t count)
{
    for (uint64_t i = 0; i < 2 * count; i++) {
        assert_is(at + i, i % 2, from + i / 2);
    }
}

static void a_bridge_that_comes_back_takes_up_the_others_ticks(void **state)
{
    (void)state;
    add_both(0, 8, 0);
    whisker_pair_run(&pair, 1, false);
    for (uint64_t tick = 8; tick < 100; tick++) {
        add(0, tick);
        assert_is(made - 1, 0, tick); /* at once */
    }
    whisker_pair_run(&pair, 1, true);
    for (uint64_t tick = 100; tick < 103; tick++) { /* before its first frame */
        add(0, tick);
    }
    add_both(103, 8, 103);
    assert_int_equal(made, 16 + 95 + 16);
    assert_pairs(16 + 95, 103, 8);
    assert_int_equal(pair.counts.realigned, 1);
    assert_int_equal(pair.counts.alone[0], 95);
    assert_int_equal(pair.counts.alone[1] + pair.counts.apart, 0);
}

static void the_second_goes_on_when_the_first_starts_again(void **state)
{
    (void)state;
    add_both(0, 7, 0);
    add(0, 7);
    whisker_pair_run(&pair, 0, false);
    collect();
    assert_is(14, 0, 7); /* it is not kept for a new tick 7 */
    add(1, 7);
    for (uint64_t tick = 8; tick < 20; tick++) { /* a common source of ticks */
        add(1, tick);
        assert_is(made - 1, 1, tick);
    }
    whisker_pair_run(&pair, 0, true);
    add(1, 20); /* of before the first's new tick 0 */
    for (uint64_t tick = 0; tick < 4; tick++) {
        add_at(0, tick, (unsigned)(4 * (21 + tick)));
        add(1, 21 + tick);
    }
    assert_int_equal(made, 16 + 13 + 8);
    assert_is(28, 1, 20);
    assert_pairs(29, 0, 4);
}

static void a_missed_edge_is_made_up_for(void **state)
{
    (void)state;
    add_both(0, 8, 0);
    add(0, 8); /* and not the second */
    add_both(9, 70, 1);
    assert_int_equal(made, 16 + 1 + 140);
    assert_is(16, 0, 8);
    assert_pairs(17, 9, 70);
    assert_int_equal(pair.counts.realigned, 1);
    assert_int_equal(pair.counts.apart, 0);
}

static void a_bridge_that_was_silent_falls_into_step_again(void **state)
{
    (void)state;
    add_both(0, 8, 0);
    for (uint64_t tick = 8; tick < WHISKER_PAIR_HELD + 20; tick++) {
        add(0, tick);
    }
    assert_int_equal(made, 16 + WHISKER_PAIR_HELD + 12); /* it is no longer waited for */
    add_both(WHISKER_PAIR_HELD + 20, 8, WHISKER_PAIR_HELD + 12);
    assert_int_equal(made, 16 + WHISKER_PAIR_HELD + 12 + 1 + 15);
    assert_int_equal(pair.counts.paired, 8 + 7); /* of the first tick both came, the first's before it was known */
    assert_int_equal(pair.counts.realigned, 1);
}

static void without_a_common_clock_ticks_are_taken_as_numbered(void **state)
{
    (void)state;
    for (uint64_t tick = 0; tick < 2 * WHISKER_PAIR_HELD; tick++) { /* two controllers */
        add(0, tick);
        add_at(1, tick, (unsigned)(4 * tick) + 5000);
    }
    assert_int_equal(pair.counts.paired, 2 * WHISKER_PAIR_HELD);
    assert_int_equal(pair.counts.apart, pair.counts.paired);
    assert_int_equal(pair.counts.alone[0] + pair.counts.alone[1] + pair.counts.realigned, 0);
    begin(state);
    for (uint64_t tick = 0; tick < 3; tick++) { /* no start-of-frame packet */
        const struct whisker_frame frame = {.tick = tick};
        for (int bridge = 0; bridge < 2; bridge++) {
            assert_int_equal(whisker_pair_add(&pair, bridge, &frame), 0);
            collect();
        }
    }
    assert_int_equal(pair.counts.paired, 3);
    assert_int_equal(pair.counts.apart, 0);
}

static void wrong_use_is_refused(void **state)
{
    (void)state;
    const struct whisker_frame frame = {.tick = 0};
    assert_int_equal(whisker_pair_add(&pair, 2, &frame), WHISKER_ERROR_ARGUMENT);
    assert_int_equal(whisker_pair_add(&pair, -1, &frame), WHISKER_ERROR_ARGUMENT);
    for (int i = 0; i < WHISKER_PAIR_HELD; i++) {
        assert_int_equal(whisker_pair_add(&pair, 0, &frame), 0);
    }
    assert_int_equal(whisker_pair_add(&pair, 0, &frame), WHISKER_ERROR_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(frames_go_in_pairs_whichever_comes_first, begin),
        cmocka_unit_test_setup(a_lost_frame_leaves_the_other_alone, begin),
        cmocka_unit_test_setup(a_silent_bridge_holds_the_other_up_for_a_while_only, begin),
        cmocka_unit_test_setup(a_bridge_that_comes_back_takes_up_the_others_ticks, begin),
        cmocka_unit_test_setup(the_second_goes_on_when_the_first_starts_again, begin),
        cmocka_unit_test_setup(a_missed_edge_is_made_up_for, begin),
        cmocka_unit_test_setup(a_bridge_that_was_silent_falls_into_step_again, begin),
        cmocka_unit_test_setup(without_a_common_clock_ticks_are_taken_as_numbered, begin),
        cmocka_unit_test_setup(wrong_use_is_refused, begin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
