/* Levels of detail against each other: two nodes of one seed and one schedule, drawn at random. One takes plain ticks
 * as a whole, the other has its registers; or the sensor's twin is left out while there is no fault, and is there all
 * the time. Each bit that they send is compared. */
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

enum { RUNS = 12, TICKS = 3000, NEVER = 1 << 30 };
enum way { TWIN, REGISTERS, RECORDS };

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

/* Every other seed has a sensor with a filter, every fourth one converts in its own time, with noise. With registers on
 * both sides some sensors are slower than the firmware waits for: breaches and chance are compared too. */
static struct pair pair_of(uint64_t seed, enum way first, enum way second)
{
    const enum way ways[] = {first, second};
    struct pair pair = {.random = seed};
    struct sim_node_parameters parameters;
    sim_node_parameters_default(&parameters, seed);
    parameters.sensor.resets_after_error = seed % 3 == 2;
    parameters.sensor.filter = seed % 2;
    if (seed % 4 == 1) {
        parameters.sensor.conversion_ns = 200000;
        parameters.sensor.noise_deg = 0.1;
    }
    if (second == REGISTERS && seed % 3 == 2)
        parameters.sensor.slow_permille = 1400;
    for (unsigned i = 0; i < 2; i++) {
        pair.nodes[i] = sim_node_new_as(&parameters);
        sim_node_by_records(pair.nodes[i], ways[i] == RECORDS);
        if (ways[i] == TWIN)
            sim_node_keep_twin(pair.nodes[i]);
        sim_node_power_on(pair.nodes[i]);
    }
    return pair;
}

static void assert_same(const struct pair *pair)
{
    sim_node *a = pair->nodes[0], *b = pair->nodes[1];
    assert_int_equal(sim_node_version(a), sim_node_version(b));
    assert_int_equal(sim_node_violations(a), sim_node_violations(b));
    for (unsigned counter = 0; counter < WHISKER_HEALTH_COUNT; counter++)
        assert_int_equal(sim_node_counted(a, counter), sim_node_counted(b, counter));
    assert_false(sim_node_differs(a) || sim_node_differs(b));
}

static void assert_same_frames(const struct pair *pair)
{
    const struct sim_node_frame a = sim_node_report(pair->nodes[0]).frame, b = sim_node_report(pair->nodes[1]).frame;
    assert_int_equal(a.line, b.line);
    assert_int_equal(a.sent, b.sent);
    assert_int_equal(a.number, b.number);
    assert_int_equal(a.begun_fs, b.begun_fs);
    assert_int_equal(a.alpha_before, b.alpha_before);
}

static void free_pair(struct pair *pair)
{
    sim_node_free(pair->nodes[0]);
    sim_node_free(pair->nodes[1]);
}

/* The first bits of a window, each answer compared. */
static void clock_bits(struct pair *pair, const uint8_t *order, unsigned bits)
{
    for (unsigned i = 0; i < bits; i++) {
        const bool mosi = i / 8 < WHISKER_SERVICE_BYTES && ((unsigned)order[i / 8] >> (7 - i % 8) & 1u);
        for (unsigned level = 2; level-- > 0;) {
            const bool sent = sim_node_sck(pair->nodes[0], level, mosi);
            assert_int_equal(sent, sim_node_sck(pair->nodes[1], level, mosi));
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
    assert_int_equal(sim_node_transfer(pair->nodes[0], bits), sim_node_transfer(pair->nodes[1], bits));
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
    const enum sim_sensor_fault kind =
        (enum sim_sensor_fault)(SIM_SENSOR_GOOD + 1 + draw(pair, SIM_SENSOR_EXTRA_CLOCK));
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

static void run_random_schedules(enum way first, enum way second)
{
    static const unsigned RARELY[] = {3, 10, 50, 200};
    for (uint64_t seed = 0; seed < RUNS; seed++) {
        struct pair pair = pair_of(seed, first, second);
        while (pair.tick < TICKS) {
            drawn_tick(&pair, RARELY[seed % 4]);
            assert_same(&pair);
            if (second == REGISTERS)
                assert_same_frames(&pair);
        }
        assert_true(pair.quick > TICKS / 2);
        free_pair(&pair);
    }
}

static void test_random_schedules_bring_the_same_bits_at_record_level(void **state)
{
    (void)state;
    run_random_schedules(REGISTERS, RECORDS);
}

static void test_random_schedules_bring_the_same_bits_with_a_twin_at_hand(void **state)
{
    (void)state;
    run_random_schedules(TWIN, REGISTERS);
}

/* A node that is brought back to its registers stands where the other one does. */
static void test_after_ticks_at_record_level_the_chip_is_the_same(void **state)
{
    (void)state;
    for (unsigned ticks = 1; ticks < 60; ticks++) {
        struct pair pair = pair_of(ticks, TWIN, RECORDS);
        while (pair.tick < ticks)
            drawn_tick(&pair, NEVER);
        sim_node_by_records(pair.nodes[1], false);
        const struct sim_node_report a = sim_node_report(pair.nodes[0]), b = sim_node_report(pair.nodes[1]);
        assert_int_equal(sim_node_fs(pair.nodes[0]), sim_node_fs(pair.nodes[1]));
        assert_int_equal(a.record, b.record);
        assert_int_equal(a.armed_fs, b.armed_fs);
        assert_int_equal(a.latch_fs, b.latch_fs);
        assert_int_equal(a.frame.line, b.frame.line);
        assert_int_equal(a.frame.sent, b.frame.sent);
        assert_int_equal(a.frame.begun_fs, b.frame.begun_fs);
        assert_int_equal(a.frame.alpha_before, b.frame.alpha_before);
        assert_same(&pair);
        free_pair(&pair);
    }
}

/* Two ticks for each check: the last one at record level again, and the present one. */
static void test_one_tick_in_a_thousand_is_checked(void **state)
{
    enum { THOUSANDS = 4 };
    uint64_t before[2], interrupts[2];
    struct pair pair = pair_of(2, REGISTERS, RECORDS);
    (void)state;
    while (pair.tick < 20)
        drawn_tick(&pair, NEVER);
    for (unsigned i = 0; i < 2; i++)
        before[i] = sim_node_report(pair.nodes[i]).interrupts;
    while (pair.tick < 20 + 1000 * THOUSANDS)
        drawn_tick(&pair, NEVER);
    for (unsigned i = 0; i < 2; i++)
        interrupts[i] = sim_node_report(pair.nodes[i]).interrupts - before[i];
    const uint64_t per_tick = interrupts[0] / (1000 * THOUSANDS);
    assert_true(interrupts[1] >= 2 * THOUSANDS * per_tick);
    assert_true(interrupts[1] < 4 * THOUSANDS * per_tick);
    free_pair(&pair);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_schedules_bring_the_same_bits_at_record_level),
        cmocka_unit_test(test_random_schedules_bring_the_same_bits_with_a_twin_at_hand),
        cmocka_unit_test(test_one_tick_in_a_thousand_is_checked),
        cmocka_unit_test(test_after_ticks_at_record_level_the_chip_is_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
