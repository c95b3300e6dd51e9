/* The whole node: firmware core, host port, sensor model, seen from the link. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim_node_lab.h"
#include "whisker_protocol.h"

static const struct sim_field REST = {0.0, 0.0};

/* The bridge's end of one transfer: clocks `clocks` bits, the order on MOSI, and fills `record`. */
static void transfer_bits(sim_node *node, const uint8_t order[8], unsigned clocks, uint8_t record[8])
{
    for (unsigned i = 0; i < 8; i++)
        record[i] = 0;
    sim_node_select(node, true);
    for (unsigned i = 0; i < clocks; i++) {
        const bool mosi = i < 64 && ((unsigned)order[i / 8] >> (7 - i % 8) & 1u);
        sim_node_sck(node, true, mosi);
        const bool miso = sim_node_sck(node, false, mosi);
        if (i < 64)
            record[i / 8] = (uint8_t)(record[i / 8] | miso << (7 - i % 8));
    }
    sim_node_select(node, false);
}

static void make_order(uint8_t tick, uint8_t order[8])
{
    for (unsigned i = 0; i < 8; i++)
        order[i] = 0;
    order[WHISKER_ORDER_TICK] = tick;
    order[WHISKER_ORDER_COMMAND] = WHISKER_COMMAND_SAMPLE;
    order[WHISKER_ORDER_CRC] = whisker_crc8(order, WHISKER_ORDER_CRC);
}

static void transfer(sim_node *node, uint8_t tick, uint8_t record[8])
{
    uint8_t order[8];
    make_order(tick, order);
    transfer_bits(node, order, 64, record);
}

/* One whole tick; the record it brings is the one of the tick before. */
static void tick(sim_node *node, uint8_t number, struct sim_field field, uint8_t record[8])
{
    sim_node_sync(node, field);
    transfer(node, number, record);
    sim_node_run(node);
}

static unsigned code_of(const uint8_t record[8])
{
    return (unsigned)whisker_get_u16(record + WHISKER_RECORD_STATUS) >> WHISKER_STATUS_CODE_SHIFT;
}

static void assert_record(const uint8_t record[8], uint8_t number, unsigned code)
{
    assert_int_equal(record[WHISKER_RECORD_CRC], whisker_crc8(record, WHISKER_RECORD_CRC));
    assert_int_equal(record[WHISKER_RECORD_TICK], number);
    assert_int_equal(code_of(record), code);
}

static void assert_good(const uint8_t record[8], uint8_t number, struct sim_field field)
{
    assert_record(record, number, WHISKER_CODE_OK);
    assert_int_equal(whisker_get_u16(record + WHISKER_RECORD_STATUS), 0);
    assert_int_equal(whisker_get_u16(record + WHISKER_RECORD_ALPHA), sim_counts(field.alpha_deg));
    assert_int_equal(whisker_get_u16(record + WHISKER_RECORD_BETA), sim_counts(field.beta_deg));
}

static int power_on(void **state)
{
    sim_node *node = sim_node_new(1);
    sim_node_power_on(node);
    *state = node;
    return 0;
}

/* Whatever a test does on the link or to the sensor's line, the firmware never breaks the sensor's timing. */
static int check_and_free(void **state)
{
    const uint32_t violations = sim_node_violations(*state);
    sim_node_free(*state);
    return violations == 0 ? 0 : -1;
}

static void fields_reach_the_record_bit_for_bit(void **state)
{
    uint8_t record[8];
    struct sim_field before = REST;
    for (unsigned n = 0; n < 2000; n++) {
        const struct sim_field field = {-95.0 + 0.095 * n, 47.0 - 0.031 * n};
        tick(*state, (uint8_t)n, field, record);
        if (n > 0)
            assert_good(record, (uint8_t)(n - 1), before);
        before = field;
    }
}

static void a_node_without_power_lets_its_lane_float(void **state)
{
    (void)state;
    uint8_t record[8];
    sim_node *node = sim_node_new(1);
    for (uint8_t n = 0; n < 3; n++) {
        tick(node, n, REST, record);
        for (unsigned i = 0; i < 8; i++)
            assert_int_equal(record[i], 0xFF);
    }
    sim_node_free(node);
}

/* Runs ticks 0 to 5 with a fault at tick 2 and checks the codes of the six records. */
static void assert_fault_costs(sim_node *node, enum sim_sensor_fault fault, unsigned argument, const unsigned codes[6])
{
    uint8_t record[8];
    for (uint8_t n = 0; n < 7; n++) {
        if (n == 2)
            sim_node_fault(node, fault, argument);
        tick(node, n, REST, record);
        if (n > 0)
            assert_record(record, (uint8_t)(n - 1), codes[n - 1]);
    }
    assert_good(record, 5, REST);
}

static void a_bad_frame_costs_its_tick_and_the_next(void **state)
{
    const unsigned absent[] = {0, 0, WHISKER_CODE_SENSOR_ABSENT, WHISKER_CODE_RESYNC, 0, 0};
    const unsigned start[] = {0, 0, WHISKER_CODE_SENSOR_START, WHISKER_CODE_RESYNC, 0, 0};
    const unsigned sum[] = {0, 0, WHISKER_CODE_SENSOR_SUM, WHISKER_CODE_RESYNC, 0, 0};
    assert_fault_costs(*state, SIM_SENSOR_DEAD, 0, absent);
    assert_fault_costs(*state, SIM_SENSOR_STUCK_LOW, 0, start);
    for (unsigned bit = 0; bit < 8; bit++)
        assert_fault_costs(*state, SIM_SENSOR_FLIP_BIT, bit, start);
    for (unsigned bit = 8; bit < 40; bit++)
        assert_fault_costs(*state, SIM_SENSOR_FLIP_BIT, bit, sum);
    for (unsigned bit = 56; bit < 64; bit++)
        assert_fault_costs(*state, SIM_SENSOR_FLIP_BIT, bit, sum);
}

static void a_flipped_error_bit_is_never_a_good_record(void **state)
{
    uint8_t record[8];
    for (unsigned bit = 40; bit < 56; bit++) {
        tick(*state, 0, REST, record);
        sim_node_fault(*state, SIM_SENSOR_FLIP_BIT, bit);
        tick(*state, 1, REST, record);
        tick(*state, 2, REST, record);
        assert_int_not_equal(whisker_get_u16(record + WHISKER_RECORD_STATUS), 0);
    }
}

static void a_dead_sensor_is_reported_for_ever_and_forgotten_when_it_returns(void **state)
{
    uint8_t record[8];
    for (uint8_t n = 0; n < 100; n++) {
        sim_node_fault(*state, SIM_SENSOR_DEAD, 0);
        tick(*state, n, REST, record);
        if (n > 0)
            assert_record(record, (uint8_t)(n - 1), n % 2 ? WHISKER_CODE_SENSOR_ABSENT : WHISKER_CODE_RESYNC);
    }
    for (uint8_t n = 100; n < 102; n++)
        tick(*state, n, REST, record);
    assert_good(record, 100, REST);
}

#define REPORT(name, bit, sensor_bit, cause, remedy) {1u << (sensor_bit), 1u << (bit)},
static void each_error_bit_reaches_the_status_beside_the_sample(void **state)
{
    static const struct {
        unsigned word, status;
    } rows[] = {WHISKER_SENSOR_ERRORS(REPORT)};
    const struct sim_field field = {10.0, -20.0};
    uint8_t record[8];
    uint8_t n = 0;
    for (unsigned i = 0; i < sizeof rows / sizeof *rows; i++) {
        sim_node_fault(*state, SIM_SENSOR_ERROR_BITS, rows[i].word);
        tick(*state, n++, field, record);
        tick(*state, n++, field, record);
        assert_record(record, (uint8_t)(n - 2), WHISKER_CODE_OK);
        assert_int_equal(whisker_get_u16(record + WHISKER_RECORD_STATUS), rows[i].status);
        assert_int_equal(whisker_get_u16(record + WHISKER_RECORD_ALPHA), sim_counts(10.0));
    }
}

static void the_tick_comes_from_the_order_and_wraps(void **state)
{
    uint8_t record[8];
    tick(*state, 254, REST, record);
    tick(*state, 255, REST, record);
    assert_good(record, 254, REST);
    tick(*state, 0, REST, record);
    assert_good(record, 255, REST);
    tick(*state, 1, REST, record);
    assert_good(record, 0, REST);
    tick(*state, 77, REST, record); /* the bridge was restarted */
    tick(*state, 78, REST, record);
    assert_good(record, 77, REST);
}

static void a_damaged_order_leaves_the_tick_counted_on(void **state)
{
    uint8_t record[8], order[8];
    tick(*state, 254, REST, record);
    for (uint8_t n = 0; n < 64; n++) {
        make_order((uint8_t)(255 + n), order);
        order[n / 8] ^= (uint8_t)(0x80u >> n % 8);
        sim_node_sync(*state, REST);
        transfer_bits(*state, order, 64, record);
        sim_node_run(*state);
        assert_good(record, (uint8_t)(254 + n), REST);
    }
}

static void extra_or_missing_clocks_cost_at_most_their_tick(void **state)
{
    uint8_t record[8], order[8];
    uint8_t n = 0;
    tick(*state, n++, REST, record);
    for (unsigned clocks = 0; clocks <= 140; clocks++) {
        make_order(n, order);
        sim_node_sync(*state, REST);
        transfer_bits(*state, order, clocks, record);
        sim_node_run(*state);
        tick(*state, (uint8_t)(n + 1), REST, record);
        assert_good(record, n, REST);
        n = (uint8_t)(n + 2);
    }
}

static void a_broken_word_starts_again_with_the_next_select(void **state)
{
    uint8_t record[8], order[8];
    tick(*state, 0, REST, record);
    make_order(1, order);
    sim_node_sync(*state, REST);
    transfer_bits(*state, order, 5, record);
    transfer_bits(*state, order, 64, record);
    assert_good(record, 0, REST);
}

static void clocks_without_select_are_another_nodes(void **state)
{
    uint8_t record[8];
    tick(*state, 0, REST, record);
    sim_node_sync(*state, REST);
    for (unsigned i = 0; i < 40; i++)
        assert_true(sim_node_sck(*state, i % 2 == 0, true));
    transfer(*state, 1, record);
    assert_good(record, 0, REST);
}

static void a_missing_sync_costs_its_tick_and_is_never_passed_off_as_a_sample(void **state)
{
    uint8_t record[8];
    tick(*state, 0, REST, record);
    tick(*state, 1, REST, record);
    transfer(*state, 2, record); /* SYNC 2 did not arrive */
    sim_node_run(*state);
    assert_good(record, 1, REST);
    tick(*state, 3, REST, record);
    assert_record(record, 1, WHISKER_CODE_LATE); /* and not 2, as the bridge expects: it reports LINK_TICK */
    tick(*state, 4, REST, record);
    assert_good(record, 3, REST);
}

static void a_transfer_cut_short_while_resynchronising_costs_no_more(void **state)
{
    uint8_t record[8], order[8];
    sim_node_fault(*state, SIM_SENSOR_DEAD, 0);
    tick(*state, 0, REST, record);
    make_order(1, order);
    sim_node_sync(*state, REST);
    transfer_bits(*state, order, 21, record);
    sim_node_run(*state);
    tick(*state, 2, REST, record);
    assert_record(record, 1, WHISKER_CODE_RESYNC);
    tick(*state, 3, REST, record);
    assert_good(record, 2, REST);
}

static void a_sync_too_early_is_reported_late_and_costs_a_resynchronisation(void **state)
{
    uint8_t record[8];
    tick(*state, 0, REST, record);
    sim_node_sync(*state, REST);
    transfer(*state, 1, record);
    assert_good(record, 0, REST);
    const uint64_t early_fs = sim_node_fs(*state) + 80000u * DSPIC_FS_PER_NS; /* the reading of tick 1 has only begun */
    sim_node_pin(*state, SIM_NODE_SYNC, true, early_fs);
    sim_node_pin(*state, SIM_NODE_SYNC, false, early_fs);
    sim_node_until(*state, early_fs + 3000u * DSPIC_FS_PER_NS);
    transfer(*state, 2, record);
    assert_record(record, 1, WHISKER_CODE_LATE);
    sim_node_run(*state);
    tick(*state, 3, REST, record);
    assert_record(record, 2, WHISKER_CODE_RESYNC);
    tick(*state, 4, REST, record);
    assert_good(record, 3, REST);
}

static void slow_and_quick_sensors_are_read_alike(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 400; seed++) {
        uint8_t record[8];
        sim_node *node = sim_node_new(seed);
        sim_node_power_on(node);
        tick(node, 0, REST, record);
        sim_node_fault(node, SIM_SENSOR_DEAD, 0);
        tick(node, 1, REST, record);
        assert_good(record, 0, REST);
        for (uint8_t n = 2; n < 5; n++)
            tick(node, n, REST, record);
        assert_good(record, 3, REST);
        assert_int_equal(sim_node_violations(node), 0);
        sim_node_free(node);
    }
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, power_on, check_and_free)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(fields_reach_the_record_bit_for_bit),
        TEST(a_node_without_power_lets_its_lane_float),
        TEST(a_bad_frame_costs_its_tick_and_the_next),
        TEST(a_flipped_error_bit_is_never_a_good_record),
        TEST(a_dead_sensor_is_reported_for_ever_and_forgotten_when_it_returns),
        TEST(each_error_bit_reaches_the_status_beside_the_sample),
        TEST(the_tick_comes_from_the_order_and_wraps),
        TEST(a_damaged_order_leaves_the_tick_counted_on),
        TEST(extra_or_missing_clocks_cost_at_most_their_tick),
        TEST(a_broken_word_starts_again_with_the_next_select),
        TEST(clocks_without_select_are_another_nodes),
        TEST(a_missing_sync_costs_its_tick_and_is_never_passed_off_as_a_sample),
        TEST(a_transfer_cut_short_while_resynchronising_costs_no_more),
        TEST(a_sync_too_early_is_reported_late_and_costs_a_resynchronisation),
        cmocka_unit_test(slow_and_quick_sensors_are_read_alike),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
