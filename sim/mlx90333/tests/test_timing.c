/* Times: what the sensor keeps, what it demands of its master. */
#include "bench.h"

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

static void a_bit_too_short_is_counted(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    assert_breach(&bench.period, &bench, MLX90333_CLOCK_PERIOD);
}

static void a_gap_after_the_start_byte_too_short_is_counted(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    assert_breach(&bench.start_gap, &bench, MLX90333_START_GAP);
}

static void a_gap_between_bytes_too_short_is_counted(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    assert_breach(&bench.gap, &bench, MLX90333_BYTE_GAP);
}

static void a_release_too_early_is_counted(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    assert_breach(&bench.release_wait, &bench, MLX90333_SELECT_HIGH);
}

static void a_first_clock_too_early_is_counted(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    assert_breach(&bench.select_wait, &bench, MLX90333_SELECT_LOW);
}

static void a_clock_in_start_up_is_counted_and_not_heard(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    power_on(&bench, 1000, 1);
    bench.now = MLX90333_STARTUP_NS - 8u * bench.period;
    mlx90333_select(&bench.sensor, bench.now, false);
    bench.now += bench.select_wait;
    clock_bits(&bench, 0xFF, 8);
    assert_in_range(bench.sensor.violations[MLX90333_CLOCK_IN_STARTUP], 12, 16);
    assert_int_equal(bench.sensor.byte, 0);
}

static void zeros_sent_are_counted_bit_by_bit(void **state)
{
    (void)state;
    struct bench bench;
    for (unsigned byte = 0; byte < 8; byte++) {
        wake(&bench, 1);
        for (unsigned i = 0; i < 8; i++) {
            clock_bits(&bench, i == byte ? 0xA5 : 0xFF, 8);
            bench.now += i == 0 ? bench.start_gap : bench.gap;
        }
        assert_int_equal(bench.sensor.violations[MLX90333_ZERO_SENT], 4);
        assert_int_equal(mlx90333_violations(&bench.sensor), 4);
    }
}

/* Awake from then on, stretched by the part's oscillator. */
static void start_up_takes_as_long_as_the_part_does(void **state)
{
    (void)state;
    const uint32_t startup_ns[] = {10000000, 16000000}, permille[] = {900, 1100};
    for (unsigned i = 0; i < 4; i++) {
        struct mlx90333_parameters p = standard();
        p.startup_ns = startup_ns[i / 2];
        p.slow_permille = (uint16_t)permille[i % 2];
        const uint64_t awake = (uint64_t)p.startup_ns * p.slow_permille / 1000u;
        for (unsigned late = 0; late < 2; late++) {
            struct bench bench;
            wake(&bench, 1);
            mlx90333_power_on(&bench.sensor, 0, &p);
            bench.now = awake - 1u + late;
            mlx90333_select(&bench.sensor, bench.now, false);
            mlx90333_clock(&bench.sensor, bench.now, true, true);
            assert_int_equal(bench.sensor.violations[MLX90333_CLOCK_IN_STARTUP], !late);
        }
    }
}

static void every_time_stretches_with_the_oscillator(void **state)
{
    (void)state;
    struct bench slow, quick;
    wake(&slow, 1);
    power_on(&slow, 1100, 1);
    wake(&quick, 1);
    power_on(&quick, 900, 1);
    const uint32_t *s[] = {&slow.sensor.t1, &slow.sensor.t2, &slow.sensor.t4,
                           &slow.sensor.t5, &slow.sensor.t6, &slow.sensor.t7};
    const uint32_t *q[] = {&quick.sensor.t1, &quick.sensor.t2, &quick.sensor.t4,
                           &quick.sensor.t5, &quick.sensor.t6, &quick.sensor.t7};
    const uint32_t nominal[] = {MLX90333_T1_NS, MLX90333_T2_NS, MLX90333_T4_NS,
                                MLX90333_T5_NS, MLX90333_T6_NS, MLX90333_T7_NS};
    for (unsigned i = 0; i < 6; i++) {
        assert_int_equal(*s[i], (uint64_t)nominal[i] * 1100u / 1000u);
        assert_int_equal(*q[i], (uint64_t)nominal[i] * 900u / 1000u);
    }
}

static void a_resynchronisation_of_a_slow_part_takes_longer(void **state)
{
    (void)state;
    unsigned count = 0;
    for (uint64_t seed = 0; seed < 400; seed++) {
        struct bench bench;
        wake(&bench, seed);
        power_on(&bench, 1100, seed);
        bench.now = 2u * MLX90333_STARTUP_NS;
        mlx90333_select(&bench.sensor, bench.now, false);
        clock_bits(&bench, 0xFF, 8);
        reselect(&bench, MLX90333_T5_NS);
        count += bench.sensor.byte == 0;
    }
    assert_in_range(count, 330, 390); /* 10 of 11 */
}

static void a_byte_asked_for_too_early_may_be_all_ones(void **state)
{
    (void)state;
    for (unsigned early = 0; early < 2; early++) {
        struct mlx90333_parameters p = standard();
        p.early_byte_is_ones = early;
        struct bench bench;
        uint8_t frame[8];
        wake_as(&bench, &p);
        set_field(&bench, 12.0, 34.0);
        bench.gap -= 1000;
        read_frame(&bench, 0xFF, frame);
        assert_int_equal(frame[1] | frame[2] << 8, early ? 0xFF00 | (sim_counts(12.0) & 0xFF) : sim_counts(12.0));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_answers_before_start_up_and_resynchronisation),
        cmocka_unit_test(a_lost_clock_shifts_every_frame_until_a_resynchronisation),
        cmocka_unit_test(resynchronisation_is_certain_at_t5_never_at_once_and_seeded_between),
        cmocka_unit_test(what_select_did_before_the_sensor_was_awake_does_not_count),
        cmocka_unit_test(a_slow_part_needs_longer_times),
        cmocka_unit_test(slow_mode_stretches_gaps_threefold_and_resynchronisation_fivefold),
        cmocka_unit_test(a_bit_too_short_is_counted),
        cmocka_unit_test(a_gap_after_the_start_byte_too_short_is_counted),
        cmocka_unit_test(a_gap_between_bytes_too_short_is_counted),
        cmocka_unit_test(a_release_too_early_is_counted),
        cmocka_unit_test(a_first_clock_too_early_is_counted),
        cmocka_unit_test(a_clock_in_start_up_is_counted_and_not_heard),
        cmocka_unit_test(zeros_sent_are_counted_bit_by_bit),
        cmocka_unit_test(start_up_takes_as_long_as_the_part_does),
        cmocka_unit_test(every_time_stretches_with_the_oscillator),
        cmocka_unit_test(a_resynchronisation_of_a_slow_part_takes_longer),
        cmocka_unit_test(a_byte_asked_for_too_early_may_be_all_ones),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
