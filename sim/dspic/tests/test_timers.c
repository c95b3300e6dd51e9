/* Timers 1 to 3: each documented side effect, one test of its own. */
#include "bench.h"

static void a_timer_counts_prescaled_cycles_to_its_period(void **state)
{
    (void)state;
    enable(IRQ_T2, 4);
    put(PR2, 99);
    put(T2CON, TCON_TON | 1u << TCON_TCKPS_SHIFT);
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_T2], 4); /* 100 counts of 8 cycles at 3.685 MHz: 217 us each */
    put(T2CON, 0);
    const uint16_t held = get(TMR2);
    pass(1u * MS);
    assert_int_equal(get(TMR2), held);
}

static void writing_the_count_begins_the_prescaler_anew(void **state)
{
    (void)state;
    put(T2CON, TCON_TON | 2u << TCON_TCKPS_SHIFT); /* 64 cycles a count */
    pass(60u * cycle_fs());
    put(TMR2, 5);
    pass(60u * cycle_fs());
    assert_int_equal(get(TMR2), 5);
    pass(4u * cycle_fs());
    assert_int_equal(get(TMR2), 6);
}

static void writing_the_control_register_disturbs_neither_count_nor_prescaler(void **state)
{
    (void)state;
    put(T2CON, TCON_TON | 2u << TCON_TCKPS_SHIFT);
    pass(100u * cycle_fs());
    put(T2CON, TCON_TON | 2u << TCON_TCKPS_SHIFT);
    pass(26u * cycle_fs());
    assert_int_equal(get(TMR2), 1);
    pass(2u * cycle_fs());
    assert_int_equal(get(TMR2), 2);
}

static void switching_off_keeps_the_count_and_clears_the_prescaler(void **state)
{
    (void)state;
    put(T2CON, TCON_TON | 2u << TCON_TCKPS_SHIFT);
    pass(180u * cycle_fs());
    put(T2CON, 2u << TCON_TCKPS_SHIFT);
    put(T2CON, TCON_TON | 2u << TCON_TCKPS_SHIFT);
    pass(60u * cycle_fs());
    assert_int_equal(get(TMR2), 2);
    pass(4u * cycle_fs());
    assert_int_equal(get(TMR2), 3);
}

static void a_period_that_the_count_has_passed_is_met_after_the_overflow(void **state)
{
    (void)state;
    put(T1CON, TCON_TON);
    pass(500u * cycle_fs());
    put(PR1, 100);
    pass(65000u * cycle_fs());
    assert_false(flagged(IRQ_T1));
    pass(700u * cycle_fs()); /* 65 536 to the overflow, and 101 */
    assert_true(flagged(IRQ_T1));
}

static void a_new_period_leaves_the_prescaler_alone(void **state)
{
    (void)state;
    put(T2CON, TCON_TON | 2u << TCON_TCKPS_SHIFT);
    pass(60u * cycle_fs());
    put(PR2, 1000);
    pass(4u * cycle_fs());
    assert_int_equal(get(TMR2), 1);
}

static void a_period_of_nought_sets_no_flag(void **state)
{
    (void)state;
    put(PR3, 0);
    put(T3CON, TCON_TON);
    pass(1u * MS);
    assert_false(flagged(IRQ_T3));
    assert_int_equal(get(TMR3), 0);
    put(PR3, 10);
    pass(8u * cycle_fs());
    assert_false(flagged(IRQ_T3));
    pass(4u * cycle_fs());
    assert_true(flagged(IRQ_T3));
}

static void the_flag_is_set_though_the_interrupt_is_off(void **state)
{
    (void)state;
    put(PR1, 50);
    put(T1CON, TCON_TON);
    pass(60u * cycle_fs());
    assert_true(flagged(IRQ_T1));
    assert_int_equal(bench.served[IRQ_T1], 0);
}

static void a_new_clock_rate_keeps_the_count(void **state)
{
    (void)state;
    put(PR2, 0xFFFF);
    put(T2CON, TCON_TON | 3u << TCON_TCKPS_SHIFT); /* 256 cycles: 69 us, then 6.6 us */
    pll();
    pass(1u * MS);
    const uint16_t slow = get(TMR2);
    assert_in_range(slow, 13, 15);
    assert_true(dspic_fcy_hz(bench.chip) > 38000000);
    pass(1u * MS);
    assert_in_range(get(TMR2) - slow, 150, 153);
}

static void the_three_count_on_their_own(void **state)
{
    (void)state;
    put(PR1, 9);
    put(PR2, 19);
    put(PR3, 39);
    enable(IRQ_T1, 4);
    enable(IRQ_T2, 4);
    enable(IRQ_T3, 4);
    put(T1CON, TCON_TON | 2u << TCON_TCKPS_SHIFT);
    put(T2CON, TCON_TON | 2u << TCON_TCKPS_SHIFT);
    put(T3CON, TCON_TON | 2u << TCON_TCKPS_SHIFT);
    pass(64u * 85u * cycle_fs());
    assert_int_equal(bench.served[IRQ_T1], 8);
    assert_int_equal(bench.served[IRQ_T2], 4);
    assert_int_equal(bench.served[IRQ_T3], 2);
}

static void timers_count_while_the_cpu_idles(void **state)
{
    (void)state;
    put(PR1, 99);
    enable(IRQ_T1, 4);
    put(T1CON, TCON_TON);
    dspic_idle(bench.chip);
    pass(150u * cycle_fs());
    assert_int_equal(bench.served[IRQ_T1], 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_timer_counts_prescaled_cycles_to_its_period),
        TEST(writing_the_count_begins_the_prescaler_anew),
        TEST(writing_the_control_register_disturbs_neither_count_nor_prescaler),
        TEST(switching_off_keeps_the_count_and_clears_the_prescaler),
        TEST(a_period_that_the_count_has_passed_is_met_after_the_overflow),
        TEST(a_new_period_leaves_the_prescaler_alone),
        TEST(a_period_of_nought_sets_no_flag),
        TEST(the_flag_is_set_though_the_interrupt_is_off),
        TEST(a_new_clock_rate_keeps_the_count),
        TEST(the_three_count_on_their_own),
        TEST(timers_count_while_the_cpu_idles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
