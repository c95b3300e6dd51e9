/* What a frame holds, by mode. */
#include "bench.h"

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

static void a_frame_is_eight_bytes(void **state)
{
    (void)state;
    struct bench bench;
    wake(&bench, 1);
    for (unsigned i = 1; i <= 20; i++) {
        clock_bits(&bench, 0xFF, 8);
        assert_int_equal(bench.sensor.byte, i % 8u);
        bench.now += bench.start_gap;
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_legal_master_reads_frame_after_frame),
        cmocka_unit_test(the_angle_is_latched_at_the_end_of_the_start_byte),
        cmocka_unit_test(a_zero_from_the_master_pulls_the_line_low),
        cmocka_unit_test(a_wrong_start_byte_gets_no_answer),
        cmocka_unit_test(the_sum_may_leave_the_error_word_out),
        cmocka_unit_test(a_frame_is_eight_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
