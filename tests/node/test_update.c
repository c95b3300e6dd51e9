/* Identity, health and firmware updates of one node through its link. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "update_bench.h"

static void begin(struct update_bench *b, uint64_t seed, uint32_t serial, uint16_t chip)
{
    assert_true(update_begin(b, seed, serial, chip));
}

static uint32_t info(struct update_bench *b, uint8_t item)
{
    uint32_t value = 0;
    assert_true(update_info(b, item, &value));
    return value;
}

static uint16_t state_of(struct update_bench *b)
{
    return (uint16_t)(info(b, WHISKER_INFO_CHIP) >> 16);
}

/* After a restart the sensor's start-up passes; then every record is good, or the loader says that it runs. */
static void settle(struct update_bench *b)
{
    update_ticks(b, 50);
    const int wanted = sim_node_version(b->node) == 0 ? WHISKER_CODE_LOADER : WHISKER_CODE_OK;
    for (int i = 0; i < 5; i++) {
        update_ticks(b, 1);
        assert_int_equal(update_code(b), wanted);
    }
}

static void a_running_node_reports_who_it_is_and_loses_no_sample(void **state)
{
    (void)state;
    struct update_bench b;
    begin(&b, 3, 0x12345678, WHISKER_LIMIT_CHIP_ID);
    update_ticks(&b, 3);
    const uint8_t item[5] = {WHISKER_INFO_SERIAL};
    for (int i = 0; i < 200; i++) { /* an order in every tick */
        update_tick(&b, i % 2 ? (int)WHISKER_SERVICE_COMMAND_POLL : (int)WHISKER_SERVICE_COMMAND_INFO, item,
                    UPDATE_NOTHING);
        assert_int_equal(whisker_get_u16(b.record + WHISKER_RECORD_STATUS), 0);
        assert_int_equal(b.record[WHISKER_RECORD_TICK], (uint8_t)(b.tick - 1u));
        assert_int_equal(b.answered, i > 0);
    }
    assert_int_equal(info(&b, WHISKER_INFO_SERIAL), 0x12345678);
    assert_int_equal(info(&b, WHISKER_INFO_CHIP), WHISKER_LIMIT_CHIP_ID);
    assert_int_equal(info(&b, WHISKER_INFO_FIRMWARE), SIM_NODE_VERSION);
    assert_int_equal(info(&b, WHISKER_INFO_WIRE) & 0xFFFFu, WHISKER_WIRE_VERSION);
    assert_int_equal(info(&b, 99), WHISKER_NODE_STATE_APPLICATION << 16);
    assert_int_equal(sim_node_violations(b.node), 0);
    sim_node_free(b.node);
}

static void faults_are_counted_once(void **state)
{
    (void)state;
    struct update_bench b;
    begin(&b, 4, 1, WHISKER_LIMIT_CHIP_ID);
    update_ticks(&b, 3);
    sim_node_fault(b.node, SIM_SENSOR_DEAD, 0);
    update_ticks(&b, 5);
    sim_node_fault(b.node, SIM_SENSOR_ERROR_BITS, 0x0008);
    update_ticks(&b, 60); /* the sensor resets itself after it has reported an error */
    assert_int_equal(info(&b, WHISKER_INFO_HEALTH + WHISKER_HEALTH_SENSOR_ERROR) & 0xFFFFu, 1);
    assert_int_equal(info(&b, WHISKER_INFO_HEALTH + WHISKER_HEALTH_ORDER_CRC) & 0xFFFFu, 0);
    const uint32_t absent = info(&b, WHISKER_INFO_HEALTH + WHISKER_HEALTH_SENSOR_ABSENT);
    assert_true((absent & 0xFFFFu) >= 1);
    assert_int_equal(absent >> 16, WHISKER_HEALTH_SENSOR_ABSENT);
    sim_node_free(b.node);
}

static void an_update_runs_the_new_image(void **state)
{
    (void)state;
    struct update_bench b;
    const struct update_image image = update_image_of(UPDATE_VERSION);
    begin(&b, 5, 77, WHISKER_LIMIT_CHIP_ID);
    assert_int_equal(update_run(&b, &image, 0), WHISKER_NODE_STATE_COMPLETE);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), UPDATE_VERSION);
    assert_int_equal(info(&b, WHISKER_INFO_FIRMWARE), UPDATE_VERSION);
    assert_int_equal(sim_node_violations(b.node), 0);
    print_message("%d bytes in %u ticks\n", UPDATE_BODY, (unsigned)b.ticks);
    sim_node_free(b.node);
}

static void unfit_images_are_refused_and_the_old_one_stays(void **state)
{
    (void)state;
    struct update_bench b;
    begin(&b, 6, 77, WHISKER_LIMIT_CHIP_ID);
    static const struct {
        unsigned at;
        uint8_t value;
        int refusal;
    } changes[] = {
        {WHISKER_IMAGE_HEADER_CHIP, 0x2A, WHISKER_NODE_STATE_OTHER_CHIP},
        {WHISKER_IMAGE_HEADER_WIRE_VERSION, WHISKER_WIRE_VERSION - 1, WHISKER_NODE_STATE_OLD_WIRE},
        {WHISKER_IMAGE_HEADER_FORMAT, 2, WHISKER_NODE_STATE_BAD_HEADER},
        {WHISKER_IMAGE_HEADER_LENGTH, 1, WHISKER_NODE_STATE_BAD_HEADER},
        {WHISKER_IMAGE_HEADER_LENGTH + 2, 0xFF, WHISKER_NODE_STATE_BAD_HEADER},
        {WHISKER_IMAGE_HEADER_FIRST_ROW, 0, WHISKER_NODE_STATE_BAD_HEADER},
        {WHISKER_IMAGE_HEADER_MAGIC, 0, WHISKER_NODE_STATE_BAD_HEADER},
    };
    for (size_t i = 0; i < sizeof changes / sizeof changes[0]; i++) {
        struct update_image image = update_image_of(UPDATE_VERSION);
        image.bytes[changes[i].at] = changes[i].value;
        update_seal(&image);
        assert_int_equal(update_run(&b, &image, 0), changes[i].refusal);
        image.bytes[WHISKER_IMAGE_HEADER_HEADER_CRC32] ^= 1u;
        assert_int_equal(update_run(&b, &image, 0), WHISKER_NODE_STATE_BAD_HEADER);
    }
    const struct update_image image = update_image_of(UPDATE_VERSION);
    assert_int_equal(update_run(&b, &image, 78), WHISKER_NODE_STATE_NOT_ADDRESSED);
    update_tick(&b, WHISKER_SERVICE_COMMAND_RUN, UPDATE_NOTHING, UPDATE_NOTHING);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), SIM_NODE_VERSION);
    assert_int_equal(update_run(&b, &image, 77), WHISKER_NODE_STATE_COMPLETE);
    sim_node_free(b.node);
}

static void a_body_other_than_announced_is_not_run(void **state)
{
    (void)state;
    struct update_bench b;
    struct update_image image = update_image_of(UPDATE_VERSION);
    begin(&b, 7, 77, WHISKER_LIMIT_CHIP_ID);
    image.bytes[WHISKER_IMAGE_HEADER_BYTES + 1000] ^= 4u;
    assert_int_equal(update_run(&b, &image, 0), WHISKER_NODE_STATE_BAD_IMAGE);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), 0);
    sim_node_disturb(b.node, SIM_NODE_RESET, RCON_EXTR);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), 0);
    assert_int_equal(state_of(&b), WHISKER_NODE_STATE_LOADER);
    sim_node_free(b.node);
}

/* The header is whole, as after a flash cell has failed. */
static void a_body_that_has_changed_since_is_not_run(void **state)
{
    (void)state;
    struct update_image image = update_image_of(UPDATE_VERSION);
    struct update_bench b = {.node = sim_node_new(9)};
    assert_non_null(b.node);
    image.bytes[WHISKER_IMAGE_HEADER_BYTES + 500] ^= 1u;
    sim_node_program(b.node, image.bytes, sizeof image.bytes);
    sim_node_power_on(b.node);
    settle(&b);
    assert_int_equal(sim_node_version(b.node), 0);
    assert_int_equal(update_code(&b), WHISKER_CODE_LOADER);
    sim_node_free(b.node);
}

static void another_chip_refuses_the_image(void **state)
{
    (void)state;
    struct update_bench b;
    const struct update_image image = update_image_of(UPDATE_VERSION);
    begin(&b, 8, 77, 0x062A);
    assert_int_equal(update_run(&b, &image, 0), WHISKER_NODE_STATE_OTHER_CHIP);
    sim_node_free(b.node);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_running_node_reports_who_it_is_and_loses_no_sample),
        cmocka_unit_test(faults_are_counted_once),
        cmocka_unit_test(an_update_runs_the_new_image),
        cmocka_unit_test(unfit_images_are_refused_and_the_old_one_stays),
        cmocka_unit_test(a_body_other_than_announced_is_not_run),
        cmocka_unit_test(a_body_that_has_changed_since_is_not_run),
        cmocka_unit_test(another_chip_refuses_the_image),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
