/* The sensor alone: a hand-driven master, right and wrong. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "mlx90333_model.h"
#include "whisker_protocol.h"

/* A master with its own times, each legal unless a test changes it. */
struct bench {
    struct mlx90333 sensor;
    uint64_t now;
    uint32_t period, start_gap, gap, select_wait, release_wait;
};

static void wake(struct bench *bench, uint64_t seed)
{
    const struct bench legal = {.period = MLX90333_T1_NS,
                                .start_gap = MLX90333_T7_NS,
                                .gap = MLX90333_T2_NS,
                                .select_wait = MLX90333_T6_NS,
                                .release_wait = MLX90333_T4_NS};
    *bench = legal;
    mlx90333_power_on(&bench->sensor, 0, 1000, seed);
    bench->now = MLX90333_STARTUP_NS + MLX90333_T5_NS;
    mlx90333_select(&bench->sensor, bench->now, false);
    bench->now += bench->select_wait;
}

static uint8_t clock_bits(struct bench *bench, uint8_t send, unsigned bits)
{
    uint8_t received = 0;
    for (unsigned i = 0; i < bits; i++) {
        const bool out = ((unsigned)send >> (7 - i) & 1u) != 0;
        mlx90333_clock(&bench->sensor, bench->now, true, out);
        const bool in = mlx90333_clock(&bench->sensor, bench->now + bench->period / 2, false, out);
        received = (uint8_t)(received << 1 | in);
        bench->now += bench->period;
    }
    bench->now -= bench->period - bench->period / 2; /* gaps count from the last falling edge */
    return received;
}

/* A frame of eight bytes from the master, then a legal gap. */
static void read_frame(struct bench *bench, uint8_t start, uint8_t frame[8])
{
    for (unsigned i = 0; i < 8; i++) {
        frame[i] = clock_bits(bench, i == 0 ? start : MLX90333_MASTER_BYTE, 8);
        bench->now += i == 0 ? bench->start_gap : bench->gap;
    }
}

static void reselect(struct bench *bench, uint64_t high_ns)
{
    mlx90333_select(&bench->sensor, bench->now, true);
    bench->now += high_ns;
    mlx90333_select(&bench->sensor, bench->now, false);
    bench->now += bench->select_wait;
}

static void assert_frame(const uint8_t frame[8], double alpha_deg, double beta_deg, unsigned errors)
{
    unsigned sum = 0;
    for (unsigned i = 1; i < 7; i++)
        sum += frame[i];
    assert_int_equal(frame[0], 0xFF);
    assert_int_equal(frame[1] | frame[2] << 8, sim_counts(alpha_deg));
    assert_int_equal(frame[3] | frame[4] << 8, sim_counts(beta_deg));
    assert_int_equal(frame[5] | frame[6] << 8, errors);
    assert_int_equal(frame[7], sum & 0xFF);
}

static bool is_all_ones(const uint8_t frame[8])
{
    for (unsigned i = 0; i < 8; i++)
        if (frame[i] != 0xFF)
            return false;
    return true;
}

static void counts_follow_the_transfer(void **state)
{
    (void)state;
    assert_int_equal(sim_counts(0.0), 0x8000);
    assert_int_equal(sim_counts(45.0), 0xC000);
    assert_int_equal(sim_counts(-45.0), 0x4000);
    assert_int_equal(sim_counts(-90.0), 0);
    assert_int_equal(sim_counts(90.0), 0xFFF0);
    assert_int_equal(sim_counts(1e300), 0xFFF0);
    assert_int_equal(sim_counts(-1e300), 0);
    assert_int_equal(sim_counts(1.0), 0x8000 + 368); /* 364.09 counts: the nearest multiple of 16 */
    assert_int_equal(sim_counts(-1.0), 0x8000 - 368);
}

static void counts_never_fall_and_stay_within_half_a_step(void **state)
{
    (void)state;
    uint16_t before = 0;
    for (double deg = -90.0; deg < 89.9; deg += 0.003) {
        const uint16_t counts = sim_counts(deg);
        const double error = counts - (0x8000 + deg * 65536.0 / 180.0);
        assert_true(counts >= before && counts % 16 == 0);
        assert_true(error >= -8.0001 && error <= 8.0001);
        before = counts;
    }
}

static void a_legal_master_reads_frame_after_frame(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    wake(&bench, 1);
    for (int i = 0; i < 50; i++) {
        mlx90333_set_field(&bench.sensor, i, -2.0 * i);
        read_frame(&bench, 0xFF, frame);
        assert_frame(frame, i, -2.0 * i, 0);
    }
    assert_int_equal(mlx90333_violations(&bench.sensor), 0);
}

static void the_angle_is_latched_at_the_end_of_the_start_byte(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    wake(&bench, 1);
    mlx90333_set_field(&bench.sensor, 5.0, 6.0);
    clock_bits(&bench, 0xFF, 8);
    bench.now += bench.start_gap;
    mlx90333_set_field(&bench.sensor, -70.0, -80.0);
    frame[0] = 0xFF;
    for (unsigned i = 1; i < 8; i++, bench.now += bench.gap)
        frame[i] = clock_bits(&bench, 0xFF, 8);
    assert_frame(frame, 5.0, 6.0, 0);
}

static void nothing_answers_before_start_up_and_resynchronisation(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    wake(&bench, 1);
    mlx90333_power_on(&bench.sensor, 0, 1000, 1);
    bench.now = MLX90333_STARTUP_NS / 2;
    mlx90333_select(&bench.sensor, bench.now, false);
    read_frame(&bench, 0xFF, frame);
    assert_true(is_all_ones(frame));
    assert_int_equal(bench.sensor.violations[MLX90333_CLOCK_IN_STARTUP], 128);

    bench.now = MLX90333_STARTUP_NS; /* awake, but /SS was not high since */
    read_frame(&bench, 0xFF, frame);
    assert_true(is_all_ones(frame));
    reselect(&bench, MLX90333_T5_NS);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 0.0, 0.0, 0);
}

static void a_lost_clock_shifts_every_frame_until_a_resynchronisation(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    wake(&bench, 1);
    clock_bits(&bench, 0xFF, 1);
    bench.now += bench.start_gap;
    for (int i = 0; i < 20; i++) {
        read_frame(&bench, 0xFF, frame);
        assert_int_not_equal(frame[1] | frame[2] << 8, 0x8000);
    }
    reselect(&bench, MLX90333_T5_NS);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 0.0, 0.0, 0);
}

/* How many of 400 differently seeded sensors, three bytes into a frame, resynchronise after /SS was high so long. */
static unsigned resynchronised(uint64_t high_ns)
{
    unsigned count = 0;
    for (uint64_t seed = 0; seed < 400; seed++) {
        struct bench bench;
        wake(&bench, seed);
        for (unsigned i = 0; i < 3; i++, bench.now += bench.start_gap)
            clock_bits(&bench, 0xFF, 8);
        reselect(&bench, high_ns);
        count += bench.sensor.byte == 0;
    }
    return count;
}

static void resynchronisation_is_certain_at_t5_never_at_once_and_seeded_between(void **state)
{
    (void)state;
    assert_int_equal(resynchronised(0), 0);
    assert_int_equal(resynchronised(MLX90333_T5_NS), 400);
    const unsigned half = resynchronised(MLX90333_T5_NS / 2);
    assert_in_range(half, 140, 260);
    assert_int_equal(resynchronised(MLX90333_T5_NS / 2), half);
}

static void what_select_did_before_the_sensor_was_awake_does_not_count(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 100; seed++) {
        struct bench bench;
        mlx90333_power_on(&bench.sensor, 0, 1000, seed);
        mlx90333_select(&bench.sensor, MLX90333_STARTUP_NS, false);
        assert_false(bench.sensor.enabled);
    }
}

static void a_zero_from_the_master_pulls_the_line_low(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    mlx90333_set_field(&bench.sensor, 89.0, 89.0);
    clock_bits(&bench, 0xFF, 8);
    bench.now += bench.start_gap;
    const uint8_t alpha_low = (uint8_t)(sim_counts(89.0) & 0xFF);
    assert_int_equal(clock_bits(&bench, 0x0F, 8), alpha_low & 0x0F);
    assert_int_equal(bench.sensor.violations[MLX90333_ZERO_SENT], 4);
}

static void a_wrong_start_byte_gets_no_answer(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    wake(&bench, 1);
    read_frame(&bench, 0xAA, frame);
    assert_int_equal(frame[0], 0xAA);
    for (unsigned i = 1; i < 8; i++)
        assert_int_equal(frame[i], 0xFF);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 0.0, 0.0, 0);
}

static void faults_damage_what_they_say(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t good[8], frame[8];
    wake(&bench, 1);
    mlx90333_set_field(&bench.sensor, 12.0, 34.0);
    read_frame(&bench, 0xFF, good);
    for (unsigned bit = 0; bit < 64; bit++) {
        mlx90333_set_fault(&bench.sensor, SIM_SENSOR_FLIP_BIT, bit);
        read_frame(&bench, 0xFF, frame);
        for (unsigned i = 0; i < 8; i++)
            assert_int_equal(frame[i] ^ good[i], i == bit / 8 ? 0x80u >> bit % 8 : 0);
    }
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_ERROR_BITS, 0x8804);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 12.0, 34.0, 0x8804);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_STUCK_LOW, 0);
    read_frame(&bench, 0xFF, frame);
    for (unsigned i = 0; i < 8; i++)
        assert_int_equal(frame[i], 0);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_DEAD, 0);
    read_frame(&bench, 0xFF, frame);
    assert_true(is_all_ones(frame));
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_GOOD, 0);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 12.0, 34.0, 0);
}

/* Two frames and a reselection by a master one nanosecond too quick in one respect. */
static void assert_breach(uint32_t *time, struct bench *bench, enum mlx90333_violation violation)
{
    uint8_t frame[8];
    *time -= 1;
    bench->now += bench->select_wait;
    reselect(bench, MLX90333_T5_NS);
    for (unsigned i = 0; i < 2; i++) {
        read_frame(bench, 0xFF, frame);
        bench->now += MLX90333_T2_NS;
    }
    clock_bits(bench, 0xFF, 8);
    bench->now += bench->release_wait;
    reselect(bench, MLX90333_T5_NS);
    assert_true(bench->sensor.violations[violation] > 0);
    assert_int_equal(mlx90333_violations(&bench->sensor), bench->sensor.violations[violation]);
}

static void each_time_cut_short_is_counted_as_itself(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    assert_breach(&bench.period, &bench, MLX90333_CLOCK_PERIOD);
    wake(&bench, 1);
    assert_breach(&bench.start_gap, &bench, MLX90333_START_GAP);
    wake(&bench, 1);
    assert_breach(&bench.gap, &bench, MLX90333_BYTE_GAP);
    wake(&bench, 1);
    assert_breach(&bench.release_wait, &bench, MLX90333_SELECT_HIGH);
    wake(&bench, 1);
    assert_breach(&bench.select_wait, &bench, MLX90333_SELECT_LOW);
}

static void a_slow_part_needs_longer_times(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    wake(&bench, 1);
    mlx90333_power_on(&bench.sensor, 0, 1100, 1);
    bench.now = 2 * MLX90333_STARTUP_NS;
    mlx90333_select(&bench.sensor, bench.now, false);
    bench.now += bench.select_wait;
    read_frame(&bench, 0xFF, frame);
    assert_int_equal(bench.sensor.violations[MLX90333_SELECT_LOW], 1);
    assert_int_equal(bench.sensor.violations[MLX90333_START_GAP], 1);
    assert_int_equal(bench.sensor.violations[MLX90333_BYTE_GAP], 6);
    assert_int_equal(bench.sensor.violations[MLX90333_CLOCK_PERIOD], 8 * 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(counts_follow_the_transfer),
        cmocka_unit_test(counts_never_fall_and_stay_within_half_a_step),
        cmocka_unit_test(a_legal_master_reads_frame_after_frame),
        cmocka_unit_test(the_angle_is_latched_at_the_end_of_the_start_byte),
        cmocka_unit_test(nothing_answers_before_start_up_and_resynchronisation),
        cmocka_unit_test(a_lost_clock_shifts_every_frame_until_a_resynchronisation),
        cmocka_unit_test(resynchronisation_is_certain_at_t5_never_at_once_and_seeded_between),
        cmocka_unit_test(what_select_did_before_the_sensor_was_awake_does_not_count),
        cmocka_unit_test(a_zero_from_the_master_pulls_the_line_low),
        cmocka_unit_test(a_wrong_start_byte_gets_no_answer),
        cmocka_unit_test(faults_damage_what_they_say),
        cmocka_unit_test(each_time_cut_short_is_counted_as_itself),
        cmocka_unit_test(a_slow_part_needs_longer_times),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
