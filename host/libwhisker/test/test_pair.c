/* Two bridges' frames in one row: whatever comes first, and whatever is lost. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "whisker/errors.h"
#include "whisker/pair.h"

#define KNOWN 0x8000u
#define OUT 512

static struct whisker_pair pair;
static struct whisker_frame out[OUT];
static size_t made;

static int begin(void **state)
{
    (void)state;
    whisker_pair_init(&pair);
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
    struct whisker_frame frame = {.tick = tick, .sequence = 77, .lane_mask = bridge ? 2 : 1};
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
        assert_int_equal(made, tick + 1 < WHISKER_PAIR_HELD ? 0 : tick + 2 - WHISKER_PAIR_HELD);
    }
    whisker_pair_end(&pair);
    collect();
    assert_int_equal(made, WHISKER_PAIR_HELD + 5);
    for (size_t i = 0; i < made; i++) {
        assert_is(i, 1, i);
    }
}

static void ticks_that_are_not_the_same_moment_are_counted(void **state)
{
    (void)state;
    static const unsigned later[] = {0, 1, 2, 0x3FFF, 0x3FFE, 0x2000};
    for (uint64_t tick = 0; tick < 6; tick++) {
        add_at(0, tick, 9);
        add_at(1, tick, 9 + later[tick]);
    }
    assert_int_equal(pair.counts.apart, 3);
    struct whisker_frame unknown = {.tick = 6}; /* no start-of-frame packet: nothing can be said */
    add_at(0, 6, 100);
    assert_int_equal(whisker_pair_add(&pair, 1, &unknown), 0);
    collect();
    assert_int_equal(pair.counts.paired, 7);
    assert_int_equal(pair.counts.apart, 3);
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
        cmocka_unit_test_setup(ticks_that_are_not_the_same_moment_are_counted, begin),
        cmocka_unit_test_setup(wrong_use_is_refused, begin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
