/* What may be broken. */
#include "bench.h"

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

static void good_frame(struct bench *bench, uint8_t frame[8])
{
    wake(bench, 7);
    set_field(bench, 12.0, 34.0);
    read_frame(bench, 0xFF, frame);
}

static void each_error_bit_comes_through_in_a_sound_frame(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    good_frame(&bench, frame);
    for (unsigned bit = 0; bit < 16; bit++) {
        mlx90333_set_fault(&bench.sensor, SIM_SENSOR_ERROR_BITS, 1u << bit);
        read_frame(&bench, 0xFF, frame);
        assert_frame(frame, 12.0, 34.0, 1u << bit);
    }
}

static void two_bits_flip_where_reported(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t good[8], frame[8];
    good_frame(&bench, good);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_FLIP_TWO, 11u | 41u << 8);
    read_frame(&bench, 0xFF, frame);
    for (unsigned i = 0; i < 8; i++)
        assert_int_equal(frame[i] ^ good[i], i == 1 ? 0x80u >> 3 : i == 5 ? 0x80u >> 1 : 0);
}

/* How many of 64 000 bits differ from the good frame's. */
static unsigned flipped(enum sim_sensor_fault fault, unsigned argument)
{
    struct bench bench;
    uint8_t good[8], frame[8];
    unsigned count = 0;
    good_frame(&bench, good);
    mlx90333_set_fault(&bench.sensor, fault, argument);
    for (unsigned n = 0; n < 1000; n++) {
        read_frame(&bench, 0xFF, frame);
        for (unsigned bit = 0; bit < 64; bit++)
            count += ((unsigned)(frame[bit / 8u] ^ good[bit / 8u]) >> bit % 8u) & 1u;
    }
    return count;
}

static void noise_flips_bits_as_often_as_reported(void **state)
{
    (void)state;
    assert_int_equal(flipped(SIM_SENSOR_NOISY, 0), 0);
    assert_in_range(flipped(SIM_SENSOR_NOISY, 65536 / 100), 540, 740); /* 1 % of 64 000, +-4 sigma */
    assert_in_range(flipped(SIM_SENSOR_NOISY, 32768), 31500, 32500);
}

static void a_floating_line_follows_nobody(void **state)
{
    (void)state;
    assert_in_range(flipped(SIM_SENSOR_FLOATING, 0), 31500, 32500);
}

static void an_extra_clock_slips_the_frame_by_a_bit_once(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    good_frame(&bench, frame);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_EXTRA_CLOCK, 20);
    read_frame(&bench, 0xFF, frame);
    assert_int_equal(bench.sensor.byte * 8u + bench.sensor.bit, 1);
    read_frame(&bench, 0xFF, frame);
    assert_int_equal(bench.sensor.byte * 8u + bench.sensor.bit, 1); /* no second one */
    assert_int_equal(mlx90333_violations(&bench.sensor), 0);        /* not the master's doing */
    reselect(&bench, MLX90333_T5_NS);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 12.0, 34.0, 0);
}

static void a_sensor_without_supply_lets_the_line_go_and_starts_anew(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    good_frame(&bench, frame);
    mlx90333_supply(&bench.sensor, bench.now, false);
    read_frame(&bench, 0xFF, frame);
    assert_true(is_all_ones(frame));
    mlx90333_supply(&bench.sensor, bench.now, true);
    bench.now += MLX90333_STARTUP_NS;
    read_frame(&bench, 0xFF, frame);
    assert_true(is_all_ones(frame)); /* awake, not resynchronised */
    reselect(&bench, MLX90333_T5_NS);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 12.0, 34.0, 0);
    assert_int_equal(mlx90333_violations(&bench.sensor), 0); /* the master was not informed */
}

static void without_the_parameter_an_error_ends_in_no_reset(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    good_frame(&bench, frame);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_ERROR_BITS, 0x0004);
    read_frame(&bench, 0xFF, frame);
    mlx90333_set_fault(&bench.sensor, SIM_SENSOR_GOOD, 0);
    read_frame(&bench, 0xFF, frame);
    assert_frame(frame, 12.0, 34.0, 0);
}

/* What a sensor remembers, but for what it has counted, when it latched, and its chances. */
#define REMEMBERED(X)                                                                                                  \
    X(select)                                                                                                          \
    X(select_ns)                                                                                                       \
    X(rise_ns)                                                                                                         \
    X(fall_ns)                                                                                                         \
    X(fresh)                                                                                                           \
    X(enabled)                                                                                                         \
    X(answering)                                                                                                       \
    X(level)                                                                                                           \
    X(byte)                                                                                                            \
    X(bit)                                                                                                             \
    X(sending)                                                                                                         \
    X(received)                                                                                                        \
    X(reset_due)                                                                                                       \
    X(dropping)                                                                                                        \
    X(dark)                                                                                                            \
    X(slipped)                                                                                                         \
    X(frame[7])                                                                                                        \
    X(fault)                                                                                                           \
    X(sense.field.since_ns)                                                                                            \
    X(sense.field.alpha_deg)                                                                                           \
    X(sense.field.beta_deg)                                                                                            \
    X(sense.field.alpha_deg_s)                                                                                         \
    X(sense.field.beta_deg_s)                                                                                          \
    X(sense.taps[4][1])                                                                                                \
    X(sense.next_ns)                                                                                                   \
    X(sense.period_ns)                                                                                                 \
    X(sense.last_ns)                                                                                                   \
    X(sense.random)

static void sensors_that_remember_different_things_are_not_equal(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    good_frame(&bench, frame);
    struct mlx90333 other = bench.sensor;
    assert_true(mlx90333_equal(&bench.sensor, &other));
#define CHANGED(field)                                                                                                 \
    *(uint8_t *)&other.field ^= 1u;                                                                                    \
    assert_false(mlx90333_equal(&bench.sensor, &other));                                                               \
    assert_false(mlx90333_equal(&other, &bench.sensor));                                                               \
    other = bench.sensor;
    REMEMBERED(CHANGED)
#undef CHANGED
    other.fault = bench.sensor.fault = SIM_SENSOR_FROZEN;
    assert_false(mlx90333_equal(&bench.sensor, &other));
}

static void what_leaves_nothing_behind_tells_no_sensors_apart(void **state)
{
    (void)state;
    struct bench bench;
    uint8_t frame[8];
    good_frame(&bench, frame);
    struct mlx90333 other = bench.sensor;
    other.violations[MLX90333_BYTE_GAP]++;
    other.random++;
    other.latch_ns++;
    other.awake_ns++; /* long over */
    other.restarting = true;
    assert_true(mlx90333_equal(&bench.sensor, &other));
    other.awake_ns = bench.now + 1u;
    assert_false(mlx90333_equal(&bench.sensor, &other));
    bench.sensor.awake_ns = other.awake_ns;
    assert_false(mlx90333_equal(&bench.sensor, &other)); /* one of the masters is to blame for a clock now */
    bench.sensor.restarting = true;
    assert_true(mlx90333_equal(&bench.sensor, &other));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faults_damage_what_they_say),
        cmocka_unit_test(a_frame_with_errors_may_end_in_a_soft_reset),
        cmocka_unit_test(a_lost_clock_is_lost_once),
        cmocka_unit_test(a_frozen_sensor_sends_sound_frames_of_the_past),
        cmocka_unit_test(each_error_bit_comes_through_in_a_sound_frame),
        cmocka_unit_test(two_bits_flip_where_reported),
        cmocka_unit_test(noise_flips_bits_as_often_as_reported),
        cmocka_unit_test(a_floating_line_follows_nobody),
        cmocka_unit_test(an_extra_clock_slips_the_frame_by_a_bit_once),
        cmocka_unit_test(a_sensor_without_supply_lets_the_line_go_and_starts_anew),
        cmocka_unit_test(without_the_parameter_an_error_ends_in_no_reset),
        cmocka_unit_test(sensors_that_remember_different_things_are_not_equal),
        cmocka_unit_test(what_leaves_nothing_behind_tells_no_sensors_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
