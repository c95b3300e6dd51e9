/* The sensor alone: a hand-driven master, right and wrong. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "mlx90333_model.h"
#include "whisker_protocol.h"

/* A master with its own times, each legal unless a test changes it. */
struct bench {
    struct mlx90333 sensor;
    uint64_t now;
    uint32_t period, start_gap, gap, select_wait, release_wait;
};

static void power_on(struct bench *bench, uint16_t slow_permille, uint64_t seed)
{
    struct mlx90333_parameters parameters;
    mlx90333_parameters_default(&parameters);
    parameters.slow_permille = slow_permille;
    parameters.seed = seed;
    mlx90333_power_on(&bench->sensor, 0, &parameters);
}

static void set_field(struct bench *bench, double alpha_deg, double beta_deg)
{
    const struct mlx90333_field field = {.since_ns = bench->now, .alpha_deg = alpha_deg, .beta_deg = beta_deg};
    mlx90333_set_field(&bench->sensor, &field);
}

static void wake(struct bench *bench, uint64_t seed)
{
    const struct bench legal = {.period = MLX90333_T1_NS,
                                .start_gap = MLX90333_T7_NS,
                                .gap = MLX90333_T2_NS,
                                .select_wait = MLX90333_T6_NS,
                                .release_wait = MLX90333_T4_NS};
    *bench = legal;
    power_on(bench, 1000, seed);
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
        set_field(&bench, i, -2.0 * i);
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
    set_field(&bench, 5.0, 6.0);
    clock_bits(&bench, 0xFF, 8);
    bench.now += bench.start_gap;
    set_field(&bench, -70.0, -80.0);
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
    power_on(&bench, 1000, 1);
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
        power_on(&bench, 1000, seed);
        mlx90333_select(&bench.sensor, MLX90333_STARTUP_NS, false);
        assert_false(bench.sensor.enabled);
    }
}

static void a_zero_from_the_master_pulls_the_line_low(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    set_field(&bench, 89.0, 89.0);
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
    set_field(&bench, 12.0, 34.0);
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
    power_on(&bench, 1100, 1);
    bench.now = 2 * MLX90333_STARTUP_NS;
    mlx90333_select(&bench.sensor, bench.now, false);
    bench.now += bench.select_wait;
    read_frame(&bench, 0xFF, frame);
    assert_int_equal(bench.sensor.violations[MLX90333_SELECT_LOW], 1);
    assert_int_equal(bench.sensor.violations[MLX90333_START_GAP], 1);
    assert_int_equal(bench.sensor.violations[MLX90333_BYTE_GAP], 6);
    assert_int_equal(bench.sensor.violations[MLX90333_CLOCK_PERIOD], 8 * 7);
}

/* Reads a frame latched at the end of its start byte and returns alpha's word. */
static unsigned alpha_of(struct bench *bench)
{
    uint8_t frame[8];
    read_frame(bench, 0xFF, frame);
    return (unsigned)frame[1] | (unsigned)frame[2] << 8;
}

static void wake_as(struct bench *bench, const struct mlx90333_parameters *parameters)
{
    wake(bench, parameters->seed);
    mlx90333_power_on(&bench->sensor, 0, parameters);
    mlx90333_select(&bench->sensor, bench->now - bench->select_wait, false);
}

static struct mlx90333_parameters standard(void)
{
    struct mlx90333_parameters parameters;
    mlx90333_parameters_default(&parameters);
    return parameters;
}

/* The field rises steadily; what a frame shows tells when it was converted. */
static void readings_are_up_to_one_conversion_old(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.conversion_ns = 350000;
    p.step_counts = 1;
    p.seed = 5;
    struct bench bench;
    wake_as(&bench, &p);
    uint64_t least = UINT64_MAX, most = 0;
    for (int i = 0; i < 200; i++) {
        const struct mlx90333_field field = {.since_ns = bench.now, .alpha_deg_s = 1000.0};
        const uint64_t since = bench.now;
        mlx90333_set_field(&bench.sensor, &field);
        const uint64_t latch = bench.now + 7u * bench.period + bench.period / 2;
        const unsigned alpha = alpha_of(&bench);
        const uint64_t age = bench.sensor.age_ns;
        least = age < least ? age : least;
        most = age > most ? age : most;
        if (latch - age > since) /* converted since the ramp began */
            assert_true(alpha - mlx90333_counts(&p, (double)(latch - age - since) * 1e-6) + 2u < 4u);
        bench.now += 123456;
    }
    assert_true(least < 20000 && most > 330000 && most < 350000);
}

static void filters_average_the_newest_conversions(void **state)
{
    (void)state;
    const double reduction_db[] = {0.0, 2.9, 4.0, 4.7, 5.6, 6.2}; /* the data sheet's column */
    double plain = 0.0;
    for (uint8_t filter = 0; filter <= 5; filter++) {
        struct mlx90333_parameters p = standard();
        p.conversion_ns = 60000;
        p.step_counts = 1;
        p.noise_deg = 1.0;
        p.filter = filter;
        struct bench bench;
        wake_as(&bench, &p);
        double sum = 0.0, squares = 0.0;
        for (int i = 0; i < 4000; i++) {
            const double a = alpha_of(&bench);
            sum += a;
            squares += a * a;
            bench.now += 700000; /* more than the taps reach */
        }
        const double deviation = sqrt(squares / 4000 - sum / 4000 * (sum / 4000));
        plain = filter == 0 ? deviation : plain;
        assert_true(fabs(20.0 * log10(plain / deviation) - reduction_db[filter]) < 0.45);
    }
}

static void a_field_vector_becomes_the_documented_angles(void **state)
{
    (void)state;
    const struct mlx90333_parameters p = standard();
    double angles[2];
    mlx90333_angles(&p, (double[]){0.0, 0.0, 40.0}, angles);
    assert_true(fabs(angles[0]) < 1e-9 && fabs(angles[1]) < 1e-9);
    mlx90333_angles(&p, (double[]){40.0, 0.0, 0.0}, angles);
    assert_true(fabs(angles[0] + 90.0) < 1e-9); /* 0 degrees along +X, and rest is 90 */
    mlx90333_angles(&p, (double[]){14.0, 0.0, 10.0}, angles);
    assert_true(fabs(angles[0] + 45.0) < 1e-9); /* k 1.4 */
}

static void a_weak_or_strong_field_sets_its_error_bit(void **state)
{
    (void)state;
    const double strength[] = {10.0, 40.0, 90.0};
    const unsigned expected[] = {0x0080, 0, 0x0100};
    for (unsigned i = 0; i < 3; i++) {
        const struct mlx90333_parameters p = standard();
        struct bench bench;
        uint8_t frame[8];
        wake_as(&bench, &p);
        const struct mlx90333_field field = {
            .since_ns = bench.now, .vector_mt = {0, 0, strength[i]}, .is_vector = true};
        mlx90333_set_field(&bench.sensor, &field);
        read_frame(&bench, 0xFF, frame);
        assert_int_equal(frame[5] | frame[6] << 8, expected[i]);
    }
}

static void field_mode_sends_the_vector(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.field_mode = true;
    struct bench bench;
    uint8_t frame[8];
    wake_as(&bench, &p);
    const struct mlx90333_field field = {.since_ns = bench.now, .vector_mt = {10, -20, 30}, .is_vector = true};
    mlx90333_set_field(&bench.sensor, &field);
    read_frame(&bench, 0xFF, frame);
    assert_int_equal((int16_t)(frame[3] | frame[4] << 8) / (int16_t)(frame[1] | frame[2] << 8), -2);
    assert_int_equal((int16_t)(frame[5] | frame[6] << 8) / (int16_t)(frame[1] | frame[2] << 8), 3);
}

static void the_sum_may_leave_the_error_word_out(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.sum_without_errors = true;
    struct bench bench;
    uint8_t frame[8];
    wake_as(&bench, &p);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_ERROR_BITS, 0x0108);
    read_frame(&bench, 0xFF, frame);
    assert_int_equal(frame[7], (uint8_t)(frame[1] + frame[2] + frame[3] + frame[4]));
}

static void a_frame_with_errors_may_end_in_a_soft_reset(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.resets_after_error = true;
    struct bench bench;
    uint8_t frame[8];
    wake_as(&bench, &p);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_ERROR_BITS, 0x0004);
    read_frame(&bench, 0xFF, frame);
    assert_int_equal(frame[5], 4);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_GOOD, 0);
    read_frame(&bench, 0xFF, frame);
    assert_true(is_all_ones(frame));
    bench.now += p.startup_ns;
    read_frame(&bench, 0xFF, frame);
    assert_true(is_all_ones(frame)); /* awake, but not resynchronised */
    reselect(&bench, MLX90333_T5_NS);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 0.0, 0.0, 0);
    assert_int_equal(mlx90333_violations(&bench.sensor), 0);
}

static void slow_mode_stretches_gaps_threefold_and_resynchronisation_fivefold(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.slow_mode = true;
    p.slow_permille = 1100;
    struct bench bench;
    wake_as(&bench, &p);
    assert_int_equal(bench.sensor.t1, 6900 * 11 / 10);
    assert_int_equal(bench.sensor.t2, 37500 * 11 / 10);
    assert_int_equal(bench.sensor.t7, 45000 * 11 / 10);
    assert_int_equal(bench.sensor.t5, 1500000 * 11 / 10);
}

static void clamps_hold_the_output(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.clamp_low = 0x1000;
    p.clamp_high = 0xE000;
    assert_int_equal(mlx90333_counts(&p, -90.0), 0x1000);
    assert_int_equal(mlx90333_counts(&p, 90.0), 0xE000);
    assert_int_equal(mlx90333_counts(&p, 0.0), 0x8000);
    assert_int_equal(mlx90333_counts(&p, (double)NAN), 0x1000);
}

static void the_older_sensor_wants_its_key_and_sends_data_twice(void **state)
{
    (void)state;
    struct mlx90333_parameters p = standard();
    p.mlx90316 = true;
    struct bench bench;
    uint8_t frame[10];
    for (unsigned key = 0; key < 2; key++) {
        wake_as(&bench, &p);
        for (unsigned i = 0; i < 10; i++) {
            frame[i] = clock_bits(&bench, i == 0 && key ? 0xAA : 0xFF, 8);
            bench.now += i == 0 ? bench.start_gap : bench.gap;
        }
        assert_int_equal(frame[2] << 8 | frame[3], key ? 0x8001 : 0xFFFF);
        assert_int_equal(frame[4] << 8 | frame[5], key ? 0x7FFE : 0xFFFF);
        assert_int_equal(frame[0], key ? 0xAA : 0xFF); /* the wired AND shows the master its own byte */
        assert_int_equal(mlx90333_violations(&bench.sensor), 0);
    }
}

static void a_lost_clock_is_lost_once(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    wake(&bench, 1);
    set_field(&bench, 30.0, -20.0);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_LOST_CLOCK, 20);
    read_frame(&bench, 0xFF, frame);
    assert_int_equal(bench.sensor.byte, 7);
    assert_int_equal(bench.sensor.bit, 7);
    reselect(&bench, MLX90333_T5_NS);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 30.0, -20.0, 0);
}

static void a_frozen_sensor_sends_sound_frames_of_the_past(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    wake(&bench, 1);
    set_field(&bench, 30.0, -20.0);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_FROZEN, 0);
    set_field(&bench, 0.0, 0.0);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 30.0, -20.0, 0);
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
        cmocka_unit_test(readings_are_up_to_one_conversion_old),
        cmocka_unit_test(filters_average_the_newest_conversions),
        cmocka_unit_test(a_field_vector_becomes_the_documented_angles),
        cmocka_unit_test(a_weak_or_strong_field_sets_its_error_bit),
        cmocka_unit_test(field_mode_sends_the_vector),
        cmocka_unit_test(the_sum_may_leave_the_error_word_out),
        cmocka_unit_test(a_frame_with_errors_may_end_in_a_soft_reset),
        cmocka_unit_test(slow_mode_stretches_gaps_threefold_and_resynchronisation_fivefold),
        cmocka_unit_test(clamps_hold_the_output),
        cmocka_unit_test(the_older_sensor_wants_its_key_and_sends_data_twice),
        cmocka_unit_test(a_lost_clock_is_lost_once),
        cmocka_unit_test(a_frozen_sensor_sends_sound_frames_of_the_past),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
