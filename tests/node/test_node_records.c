/* Record level against the registers: two nodes of one seed and one schedule, drawn at random, one of them allowed to
 * take plain ticks as a whole. Each bit that they send is compared. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "crc32.h"
#include "service.h" // SERVICE_WORDS
#include "sim_node_lab.h"
#include "sim_rng.h"
#include "whisker_protocol.h"

enum { RUNS = 12, TICKS = 3000, REGISTERS = 0, RECORDS = 1, NEVER = 1 << 30 };

struct pair {
    sim_node *nodes[2];
    uint64_t random;
    struct sim_field field;
    unsigned tick, quick; /* ticks so far, and those drawn as plain */
};

static unsigned draw(struct pair *pair, unsigned bound)
{
    return (unsigned)(sim_rng_mix(&pair->random) % bound);
}

/* Every other seed has a sensor with a filter, every fourth one converts in its own time, with noise. */
static struct pair pair_of(uint64_t seed)
{
    struct pair pair = {.random = seed};
    struct sim_node_parameters parameters;
    sim_node_parameters_default(&parameters, seed);
    parameters.sensor.filter = seed % 2;
    if (seed % 4 == 1) {
        parameters.sensor.conversion_ns = 200000;
        parameters.sensor.noise_deg = 0.1;
    }
    for (unsigned i = 0; i < 2; i++) {
        pair.nodes[i] = sim_node_new_as(&parameters);
        sim_node_by_records(pair.nodes[i], i == RECORDS);
        sim_node_power_on(pair.nodes[i]);
    }
    return pair;
}

static void assert_same(const struct pair *pair)
{
    assert_int_equal(sim_node_version(pair->nodes[REGISTERS]), sim_node_version(pair->nodes[RECORDS]));
    assert_int_equal(sim_node_violations(pair->nodes[REGISTERS]), sim_node_violations(pair->nodes[RECORDS]));
    for (unsigned counter = 0; counter < WHISKER_HEALTH_COUNT; counter++)
        assert_int_equal(sim_node_counted(pair->nodes[REGISTERS], counter),
                         sim_node_counted(pair->nodes[RECORDS], counter));
    assert_false(sim_node_differs(pair->nodes[RECORDS]));
}

/* The first bits of a window, each answer compared. */
static void clock_bits(struct pair *pair, const uint8_t *order, unsigned bits)
{
    for (unsigned i = 0; i < bits; i++) {
        const bool mosi = i / 8 < WHISKER_SERVICE_BYTES && ((unsigned)order[i / 8] >> (7 - i % 8) & 1u);
        for (unsigned level = 2; level-- > 0;) {
            const bool sent = sim_node_sck(pair->nodes[REGISTERS], level, mosi);
            assert_int_equal(sent, sim_node_sck(pair->nodes[RECORDS], level, mosi));
        }
    }
}

static void select_both(struct pair *pair, bool low)
{
    for (unsigned i = 0; i < 2; i++)
        sim_node_select(pair->nodes[i], low);
}

static void window(struct pair *pair, const uint8_t *order, unsigned bits)
{
    select_both(pair, true);
    clock_bits(pair, order, bits);
    select_both(pair, false);
}

static void whole_window(struct pair *pair, const uint8_t *order)
{
    uint64_t bits = 0;
    for (unsigned i = 0; i < WHISKER_ORDER_BYTES; i++)
        bits = bits << 8 | order[i];
    assert_int_equal(sim_node_transfer(pair->nodes[REGISTERS], bits), sim_node_transfer(pair->nodes[RECORDS], bits));
}

static void second_window(struct pair *pair, uint8_t tick)
{
    uint8_t order[WHISKER_SERVICE_BYTES] = {tick, WHISKER_SERVICE_COMMAND_INFO, (uint8_t)draw(pair, 40)};
    order[WHISKER_SERVICE_HEAD_CRC] = whisker_crc8(order, WHISKER_SERVICE_HEAD_CRC);
    const uint32_t crc = crc32_of(WHISKER_CRC32_INIT, order, WHISKER_SERVICE_CRC32) ^ WHISKER_CRC32_XOR_OUT;
    for (unsigned i = 0; i < 4; i++)
        order[WHISKER_SERVICE_CRC32 + i] = (uint8_t)(crc >> (24 - 8 * i));
    order[20] ^= draw(pair, 4) == 0;
    window(pair, order, 8 * WHISKER_SERVICE_BYTES);
}

/* What the bridge does in this tick. */
static void drawn_transfer(struct pair *pair, unsigned kind)
{
    uint8_t order[WHISKER_SERVICE_BYTES] = {(uint8_t)pair->tick};
    order[WHISKER_ORDER_COMMAND] = kind == 1 || kind == 2 ? WHISKER_COMMAND_SERVICE : WHISKER_COMMAND_SAMPLE;
    order[WHISKER_ORDER_CRC] = whisker_crc8(order, WHISKER_ORDER_CRC);
    if (kind == 3)
        order[draw(pair, WHISKER_ORDER_BYTES)] ^= (uint8_t)(1u << draw(pair, 8));
    if (kind == 4)
        window(pair, order, draw(pair, 64));
    else if (kind == 5)
        window(pair, order, 65 + draw(pair, 20));
    else if (kind == 6)
        select_both(pair, false); /* no select at all */
    else if (draw(pair, 2) == 0)
        window(pair, order, 64);
    else
        whole_window(pair, order);
    if (kind == 1)
        second_window(pair, (uint8_t)pair->tick);
}

static void wander(struct pair *pair, double *angle, bool jumps)
{
    const double most = jumps ? 90.0 : 12.0; /* more than 30 in a tick is not believed */
    *angle += most * (2.0 * draw(pair, 1001) / 1000.0 - 1.0);
    *angle = *angle > 80.0 ? 80.0 : *angle < -80.0 ? -80.0 : *angle;
}

static void spoil(struct pair *pair)
{
    static const enum sim_sensor_fault KINDS[] = {SIM_SENSOR_FLIP_BIT,   SIM_SENSOR_DEAD,       SIM_SENSOR_STUCK_LOW,
                                                  SIM_SENSOR_ERROR_BITS, SIM_SENSOR_LOST_CLOCK, SIM_SENSOR_EXTRA_CLOCK};
    const enum sim_sensor_fault kind = KINDS[draw(pair, sizeof KINDS / sizeof *KINDS)];
    const unsigned argument = draw(pair, 64);
    for (unsigned i = 0; i < 2; i++)
        sim_node_fault(pair->nodes[i], kind, argument);
}

static void cut_supply(struct pair *pair)
{
    for (unsigned i = 0; i < 2; i++)
        sim_node_cut(pair->nodes[i], 1000u * (1u + pair->tick % 499u));
}

static void power_on_again(struct pair *pair)
{
    for (unsigned i = 0; i < 2; i++)
        sim_node_power_on(pair->nodes[i]);
}

static void restore_supply(struct pair *pair)
{
    for (unsigned i = 0; i < 2; i++) {
        if (sim_node_dark(pair->nodes[i]))
            sim_node_restore(pair->nodes[i]);
    }
}

/* One tick in `rarely` is out of the ordinary. */
static void drawn_tick(struct pair *pair, unsigned rarely)
{
    const unsigned kind = rarely != NEVER && draw(pair, rarely) == 0 ? 1 + draw(pair, 12) : 0;
    wander(pair, &pair->field.alpha_deg, kind == 11);
    wander(pair, &pair->field.beta_deg, kind == 11);
    if (kind == 7 || kind == 8)
        spoil(pair);
    for (unsigned i = 0; i < 2; i++)
        sim_node_sync(pair->nodes[i], pair->field);
    drawn_transfer(pair, kind);
    if (kind == 9)
        spoil(pair); /* of the next reading, in the midst of this tick */
    if (kind == 10 && draw(pair, 4) == 0)
        cut_supply(pair);
    for (unsigned i = 0; i < 2; i++)
        sim_node_run(pair->nodes[i]);
    if (draw(pair, 20) == 0)
        restore_supply(pair);
    if (kind == 12 && draw(pair, 4) == 0)
        power_on_again(pair);
    pair->quick += kind == 0;
    pair->tick++;
}

static void test_random_schedules_bring_the_same_bits(void **state)
{
    static const unsigned RARELY[] = {3, 10, 50, 200};
    (void)state;
    for (uint64_t seed = 0; seed < RUNS; seed++) {
        struct pair pair = pair_of(seed);
        while (pair.tick < TICKS) {
            drawn_tick(&pair, RARELY[seed % 4]);
            assert_same(&pair);
        }
        assert_true(pair.quick > TICKS / 2);
        sim_node_free(pair.nodes[REGISTERS]);
        sim_node_free(pair.nodes[RECORDS]);
    }
}

/* A node that is brought back to its registers stands where the other one does. */
static void test_after_ticks_at_record_level_the_chip_is_the_same(void **state)
{
    (void)state;
    for (unsigned ticks = 1; ticks < 60; ticks++) {
        struct pair pair = pair_of(ticks);
        while (pair.tick < ticks)
            drawn_tick(&pair, NEVER);
        sim_node_by_records(pair.nodes[RECORDS], false);
        const struct sim_node_report a = sim_node_report(pair.nodes[REGISTERS]),
                                     b = sim_node_report(pair.nodes[RECORDS]);
        assert_int_equal(sim_node_fs(pair.nodes[REGISTERS]), sim_node_fs(pair.nodes[RECORDS]));
        assert_int_equal(a.record, b.record);
        assert_int_equal(a.armed_fs, b.armed_fs);
        assert_int_equal(a.latch_fs, b.latch_fs);
        assert_int_equal(a.frame.line, b.frame.line);
        assert_int_equal(a.frame.sent, b.frame.sent);
        assert_int_equal(a.frame.begun_fs, b.frame.begun_fs);
        assert_int_equal(a.frame.alpha_before, b.frame.alpha_before);
        assert_same(&pair);
        sim_node_free(pair.nodes[REGISTERS]);
        sim_node_free(pair.nodes[RECORDS]);
    }
}

/* Two ticks for each check: the last one at record level again, and the present one. */
static void test_one_tick_in_a_thousand_is_checked(void **state)
{
    enum { THOUSANDS = 4 };
    uint64_t before[2], interrupts[2];
    struct pair pair = pair_of(2);
    (void)state;
    while (pair.tick < 20)
        drawn_tick(&pair, NEVER);
    for (unsigned i = 0; i < 2; i++)
        before[i] = sim_node_report(pair.nodes[i]).interrupts;
    while (pair.tick < 20 + 1000 * THOUSANDS)
        drawn_tick(&pair, NEVER);
    for (unsigned i = 0; i < 2; i++)
        interrupts[i] = sim_node_report(pair.nodes[i]).interrupts - before[i];
    const uint64_t per_tick = interrupts[REGISTERS] / (1000 * THOUSANDS);
    assert_true(interrupts[RECORDS] >= 2 * THOUSANDS * per_tick);
    assert_true(interrupts[RECORDS] < 4 * THOUSANDS * per_tick);
    sim_node_free(pair.nodes[REGISTERS]);
    sim_node_free(pair.nodes[RECORDS]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_schedules_bring_the_same_bits),
        cmocka_unit_test(test_one_tick_in_a_thousand_is_checked),
        cmocka_unit_test(test_after_ticks_at_record_level_the_chip_is_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
