/* Loading an image into many nodes, and all that may befall them meanwhile. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "fake_nodes.h"
#include "image_bytes.h"
#include "whisker/errors.h"
#include "whisker_protocol.h"

enum { ROWS = 20, BLOCKS = ROWS * 4, OLD = 0x0100, NEW = 0x0203 };
#define ALL ((UINT32_C(1) << WHISKER_FRAME_LANES) - 1)
#define IMAGE_BYTES (WHISKER_IMAGE_HEADER_BYTES + ROWS * WHISKER_LIMIT_FLASH_ROW_BYTES)

static uint8_t bytes[IMAGE_BYTES];
static struct whisker_image image;
static struct whisker_update updates[WHISKER_FRAME_LANES];
static uint32_t shown, shown_total;

static void show(void *context, uint32_t blocks, uint32_t total)
{
    (void)context;
    assert_true(blocks >= shown && blocks <= total);
    shown = blocks;
    shown_total = total;
}

static int begin(void **state)
{
    (void)state;
    fake_nodes_reset(6);
    shown = shown_total = 0;
    return whisker_image_parse(bytes, image_make(bytes, ROWS), &image);
}

static int update_of(uint32_t lanes, uint32_t serial)
{
    shown = 0;
    return whisker_nodes_update(NULL, lanes, serial, &image, show, NULL, updates);
}

static void update(uint32_t lanes, uint32_t serial)
{
    assert_int_equal(update_of(lanes, serial), WHISKER_OK);
}

/* Only these lanes have the new image and run it. */
static void assert_done(uint32_t lanes)
{
    for (int lane = 0; lane < 6; lane++) {
        const bool wanted = lanes >> lane & 1;
        assert_int_equal(updates[lane].done, wanted);
        if (wanted) {
            assert_int_equal(fakes.node[lane].firmware, NEW);
            assert_int_equal(fakes.node[lane].state, WHISKER_NODE_STATE_APPLICATION);
        }
    }
}

static void all_take_an_image_at_the_same_time(void **state)
{
    (void)state;
    fake_nodes_reset(WHISKER_FRAME_LANES);
    update(ALL, 0);
    assert_done(0x3F);
    assert_true(updates[27].done);
    assert_int_equal(shown, BLOCKS);
    assert_int_equal(shown_total, BLOCKS);
    assert_int_equal(fakes.count_of[WHISKER_SERVICE_COMMAND_BLOCK], BLOCKS); /* not one for each node */
}

static void nodes_that_erase_for_30_ms_are_waited_for(void **state)
{
    (void)state;
    for (int lane = 0; lane < 6; lane++) {
        fakes.node[lane].erase_ticks = (uint16_t)(60 - lane);
        fakes.node[lane].restart_ticks = 40;
    }
    update(0x3F, 0);
    assert_done(0x3F);
}

static void nodes_that_miss_orders_still_get_all_blocks(void **state)
{
    (void)state;
    for (int lane = 0; lane < 6; lane++) {
        fakes.node[lane].lose_percent = 5u * (unsigned)lane; /* to 25 */
    }
    update(0x3F, 0);
    assert_done(0x3F);
}

static void a_node_that_misses_the_start_is_reported_again(void **state)
{
    (void)state;
    fakes.node[2].misses_runs = 2;
    update(0x3F, 0);
    assert_done(0x3F);
}

static void one_node_is_addressed_by_its_number(void **state)
{
    (void)state;
    update(1u << 3, 4);
    assert_done(1u << 3);
    assert_int_equal(fakes.node[2].firmware, OLD);
    assert_int_equal(fakes.node[2].state, WHISKER_NODE_STATE_APPLICATION);
    assert_false(updates[2].wanted);
}

/* The host asks for both lanes of a doubled number; the others keep what they have. */
static void nodes_with_the_same_number_load_together(void **state)
{
    (void)state;
    fakes.node[1].serial = fakes.node[4].serial = 77;
    update(1u << 1 | 1u << 4, 77);
    assert_done(1u << 1 | 1u << 4);
    assert_int_equal(fakes.node[0].firmware, OLD);
}

static void a_node_of_another_number_is_reported_apart(void **state)
{
    (void)state;
    fakes.node[5].state = WHISKER_NODE_STATE_LOADER; /* or it would not even look at the header */
    update(1u << 5, 77);
    assert_done(0);
    assert_int_equal(updates[5].state, WHISKER_NODE_STATE_NOT_ADDRESSED);
    assert_int_equal(fakes.node[5].firmware, OLD);
}

static void an_image_for_another_chip_is_refused_and_the_rest_go_on(void **state)
{
    (void)state;
    fakes.node[2].chip = 0x062A;
    update(0x3F, 0);
    assert_done(0x3F & ~(1u << 2));
    assert_int_equal(updates[2].state, WHISKER_NODE_STATE_OTHER_CHIP);
    assert_int_equal(fakes.node[2].firmware, OLD);
    assert_int_equal(fakes.node[2].state, WHISKER_NODE_STATE_APPLICATION); /* it runs what it has */
}

static void an_older_wire_version_is_refused(void **state)
{
    (void)state;
    bytes[WHISKER_IMAGE_HEADER_WIRE_VERSION] = WHISKER_WIRE_VERSION - 1;
    image_seal(bytes, IMAGE_BYTES);
    assert_int_equal(whisker_image_parse(bytes, IMAGE_BYTES, &image), WHISKER_OK);
    update(0x3F, 0);
    assert_done(0);
    for (int lane = 0; lane < 6; lane++) {
        assert_int_equal(updates[lane].state, WHISKER_NODE_STATE_OLD_WIRE);
        assert_int_equal(fakes.node[lane].firmware, OLD);
    }
    assert_int_equal(fakes.count_of[WHISKER_SERVICE_COMMAND_BLOCK], 0);
}

static void a_lane_lost_midway_is_left_behind(void **state)
{
    (void)state;
    fakes.node[3].gone_at = 37;
    update(0x3F, 0);
    assert_done(0x3F & ~(1u << 3));
    assert_true(updates[3].silent);
    assert_int_equal(updates[3].blocks, 37);
}

static void all_lanes_lost_end_the_update(void **state)
{
    (void)state;
    for (int lane = 0; lane < 6; lane++) {
        fakes.node[lane].gone_at = (uint16_t)(10 * lane);
    }
    update(0x3F, 0);
    assert_done(0);
    for (int lane = 0; lane < 6; lane++) {
        assert_true(updates[lane].silent);
    }
}

/* A supply that fails for a moment leaves the node in its loader: it is not waited for, and takes the next try. */
static void a_power_cut_costs_a_second_try(void **state)
{
    (void)state;
    static const uint16_t AT[] = {0, 1, 31, 32, 63, 79};
    for (int lane = 0; lane < 6; lane++) {
        fakes.node[lane].cut_at = AT[lane];
        fakes.node[lane].restart_ticks = 40;
    }
    update(0x3F, 0);
    assert_done(0);
    for (int lane = 0; lane < 6; lane++) {
        assert_false(updates[lane].silent);
        assert_int_equal(updates[lane].state, WHISKER_NODE_STATE_LOADER);
    }
    update(0x3F, 0);
    assert_done(0x3F);
}

static void a_node_that_takes_no_more_is_given_up(void **state)
{
    (void)state;
    fakes.node[0].stuck_at = 0;
    fakes.node[4].stuck_at = 50;
    update(0x3F, 0);
    assert_done(0x3F & ~(1u << 4 | 1u));
    assert_true(updates[0].stuck && updates[4].stuck);
    assert_int_equal(updates[4].blocks, 50);
}

/* The others are ahead while one is slow: they are not taken for stuck. */
static void nodes_that_wait_for_a_slow_one_are_not_given_up(void **state)
{
    (void)state;
    fakes.node[0].state = WHISKER_NODE_STATE_LOADING;
    fakes.node[0].next = 60; /* of an update that was broken off, same header */
    fakes.node[0].loads = BLOCKS;
    update(0x3F, 0);
    assert_done(0x3F);
}

static void a_node_that_does_not_leave_its_application_is_left(void **state)
{
    (void)state;
    fakes.node[1].stays = true;
    update(0x3F, 0);
    assert_done(0x3F & ~(1u << 1));
    assert_int_equal(updates[1].state, WHISKER_NODE_STATE_APPLICATION);
    assert_int_equal(fakes.count_of[WHISKER_SERVICE_COMMAND_ENTER], 8); /* rounds, and no more */
    assert_int_equal(fakes.node[1].firmware, OLD);
}

static void flash_that_does_not_hold_is_reported(void **state)
{
    (void)state;
    fakes.node[2].flash_fails_at = 12;
    fakes.node[5].damaged = true;
    update(0x3F, 0);
    assert_done(0x3F & ~(1u << 2 | 1u << 5));
    assert_int_equal(updates[2].state, WHISKER_NODE_STATE_FLASH_FAILED);
    assert_int_equal(updates[5].state, WHISKER_NODE_STATE_BAD_IMAGE);
    assert_false(updates[2].silent || updates[5].silent);
}

static void no_lanes_are_no_work(void **state)
{
    (void)state;
    update(0, 0);
    assert_done(0);
    assert_int_equal(fakes.count_of[WHISKER_SERVICE_COMMAND_BEGIN], 0);
}

static void a_bridge_that_goes_ends_the_update_at_any_order(void **state)
{
    (void)state;
    for (unsigned after = 0; after < 160; after += 7) {
        begin(NULL);
        fakes.fail_after = after;
        fakes.poll_error = WHISKER_ERROR_DEVICE_GONE;
        assert_int_equal(update_of(0x3F, 0), WHISKER_ERROR_DEVICE_GONE);
        assert_int_equal(fakes.orders, after + 1);
    }
}

static void a_sound_image_is_taken_apart(void **state)
{
    (void)state;
    assert_ptr_equal(image.header, bytes);
    assert_ptr_equal(image.body, bytes + WHISKER_IMAGE_HEADER_BYTES);
    assert_int_equal(image.length, ROWS * WHISKER_LIMIT_FLASH_ROW_BYTES);
    assert_int_equal(image.chip, WHISKER_LIMIT_CHIP_ID);
    assert_int_equal(image.version, NEW);
    assert_int_equal(image.options, 0x8000);
    assert_int_equal(image.wire_version, WHISKER_WIRE_VERSION);
}

static void an_image_with_any_byte_changed_is_refused(void **state)
{
    (void)state;
    for (size_t i = 0; i < IMAGE_BYTES; i++) {
        bytes[i] ^= (uint8_t)(1u << i % 8u);
        assert_int_equal(whisker_image_parse(bytes, IMAGE_BYTES, &image), WHISKER_ERROR_IMAGE);
        bytes[i] ^= (uint8_t)(1u << i % 8u);
    }
}

static void an_image_of_any_other_length_is_refused(void **state)
{
    (void)state;
    for (size_t count = 0; count < IMAGE_BYTES; count++) {
        assert_int_equal(whisker_image_parse(bytes, count, &image), WHISKER_ERROR_IMAGE);
    }
    image_seal(bytes, IMAGE_BYTES - 1); /* consistent, but no whole rows */
    assert_int_equal(whisker_image_parse(bytes, IMAGE_BYTES - 1, &image), WHISKER_ERROR_IMAGE);
    image_seal(bytes, WHISKER_IMAGE_HEADER_BYTES);
    assert_int_equal(whisker_image_parse(bytes, WHISKER_IMAGE_HEADER_BYTES, &image), WHISKER_ERROR_IMAGE);
}

static void an_image_larger_than_the_flash_is_refused(void **state)
{
    (void)state;
    const unsigned room = WHISKER_LIMIT_FLASH_ROWS - WHISKER_LIMIT_APPLICATION_ROW - 1u;
    for (unsigned rows = room; rows <= room + 1u; rows++) {
        uint8_t *large = malloc(WHISKER_IMAGE_HEADER_BYTES + rows * WHISKER_LIMIT_FLASH_ROW_BYTES);
        assert_non_null(large);
        const size_t count = image_make(large, rows);
        assert_int_equal(whisker_image_parse(large, count, &image), rows > room ? WHISKER_ERROR_IMAGE : WHISKER_OK);
        free(large);
    }
}

#define TEST(name) cmocka_unit_test_setup(name, begin)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(all_take_an_image_at_the_same_time),
        TEST(nodes_that_erase_for_30_ms_are_waited_for),
        TEST(nodes_that_miss_orders_still_get_all_blocks),
        TEST(a_node_that_misses_the_start_is_reported_again),
        TEST(one_node_is_addressed_by_its_number),
        TEST(nodes_with_the_same_number_load_together),
        TEST(a_node_of_another_number_is_reported_apart),
        TEST(an_image_for_another_chip_is_refused_and_the_rest_go_on),
        TEST(an_older_wire_version_is_refused),
        TEST(a_lane_lost_midway_is_left_behind),
        TEST(all_lanes_lost_end_the_update),
        TEST(a_power_cut_costs_a_second_try),
        TEST(a_node_that_takes_no_more_is_given_up),
        TEST(nodes_that_wait_for_a_slow_one_are_not_given_up),
        TEST(a_node_that_does_not_leave_its_application_is_left),
        TEST(flash_that_does_not_hold_is_reported),
        TEST(no_lanes_are_no_work),
        TEST(a_bridge_that_goes_ends_the_update_at_any_order),
        TEST(a_sound_image_is_taken_apart),
        TEST(an_image_with_any_byte_changed_is_refused),
        TEST(an_image_of_any_other_length_is_refused),
        TEST(an_image_larger_than_the_flash_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
