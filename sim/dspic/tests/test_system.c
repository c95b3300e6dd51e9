/* Clock switch, watchdog, resets: each documented side effect, one test of its own. */
#include "bench.h"

static void the_clock_switches_only_behind_its_keys(void **state)
{
    (void)state;
    put(PLLFBD, 40);
    put(CLKDIV, 0);
    osccon(1, OSCCON_HIGH_KEY1, 0x9B, OSC_FRC_PLL);
    osccon(0, OSCCON_LOW_KEY1, OSCCON_LOW_KEY2, OSCCON_OSWEN);
    pass(3u * MS);
    assert_int_equal(get(OSCCON) >> OSCCON_COSC_SHIFT & 7u, OSC_FRC);
    osccon(1, OSCCON_HIGH_KEY1, OSCCON_HIGH_KEY2, OSC_FRC_PLL);
    osccon(0, OSCCON_LOW_KEY1, OSCCON_LOW_KEY2, OSCCON_OSWEN);
    assert_false(get(OSCCON) & OSCCON_LOCK);
    pass(3u * MS);
    assert_true(get(OSCCON) & OSCCON_LOCK);
    assert_in_range(dspic_fcy_hz(bench.chip), 38692000, 38693000); /* 7.37 MHz * 42 / 8 */
    assert_int_equal(dspic_violations(bench.chip).overclocked, 0);
    put(OSCCON, 0);
    assert_int_equal(dspic_violations(bench.chip).unlock, 1);
}

static void more_than_40_mips_is_noticed(void **state)
{
    (void)state;
    put(PLLFBD, 42); /* M 44: 40.5 MHz */
    put(CLKDIV, 0);
    osccon(1, OSCCON_HIGH_KEY1, OSCCON_HIGH_KEY2, OSC_FRC_PLL);
    osccon(0, OSCCON_LOW_KEY1, OSCCON_LOW_KEY2, OSCCON_OSWEN);
    pass(3u * MS);
    assert_int_equal(dspic_violations(bench.chip).overclocked, 1);
}

static void the_watchdog_resets_a_firmware_that_forgets_it(void **state)
{
    (void)state;
    dspic_sfr_modify(bench.chip, RCON, RCON_SWDTEN | RCON_POR | RCON_BOR, RCON_SWDTEN);
    pass(100u * MS);
    dspic_clear_watchdog(bench.chip);
    pass(100u * MS);
    assert_int_equal(bench.starts, 1);
    pass(100u * MS);
    assert_int_equal(bench.starts, 2);
    assert_int_equal(get(RCON), RCON_WDTO); /* and it is off again */
}

static void resets_report_their_cause(void **state)
{
    (void)state;
    assert_int_equal(get(RCON), RCON_POR | RCON_BOR);
    put(RCON, 0);
    dspic_disturb_reset(bench.chip, RCON_BOR);
    assert_int_equal(get(RCON), RCON_BOR);
    assert_int_equal(bench.starts, 2);
    dspic_disturb_trap(bench.chip, DSPIC_TRAP_DMA);
    assert_int_equal(bench.traps, 1);
    assert_true(get(INTCON1) & INTCON1_DMACERR);
}

static void reset_within(struct bench *b, unsigned irq)
{
    (void)irq;
    dspic_reset(b->chip, RCON_SWR);
}

static void a_reset_ends_the_interrupt_it_is_called_from(void **state)
{
    (void)state;
    bench.within = reset_within;
    put(RPINR0, 12u << 8);
    enable(IRQ_INT1, 4);
    dspic_input(bench.chip, 12, true, dspic_now_fs(bench.chip));
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_INT1], 1);
    assert_int_equal(bench.starts, 2);
    assert_true(get(RCON) & RCON_SWR);
}

static void a_pause_between_the_keys_voids_them(void **state)
{
    (void)state;
    put(PLLFBD, 40);
    put(CLKDIV, 0);
    dspic_byte_write(bench.chip, OSCCON + 1u, OSCCON_HIGH_KEY1);
    pass(3u * cycle_fs());
    dspic_byte_write(bench.chip, OSCCON + 1u, OSCCON_HIGH_KEY2);
    dspic_byte_write(bench.chip, OSCCON + 1u, OSC_FRC_PLL);
    assert_int_equal(get(OSCCON) >> OSCCON_NOSC_SHIFT & 7u, 0);
    dspic_byte_write(bench.chip, OSCCON + 1u, OSCCON_HIGH_KEY1);
    dspic_byte_write(bench.chip, OSCCON + 1u, OSCCON_HIGH_KEY2);
    pass(3u * cycle_fs());
    dspic_byte_write(bench.chip, OSCCON + 1u, OSC_FRC_PLL);
    assert_int_equal(get(OSCCON) >> OSCCON_NOSC_SHIFT & 7u, 0);
}

static void the_keys_of_one_half_do_not_open_the_other(void **state)
{
    (void)state;
    dspic_byte_write(bench.chip, OSCCON, OSCCON_LOW_KEY1);
    dspic_byte_write(bench.chip, OSCCON, OSCCON_LOW_KEY2);
    dspic_byte_write(bench.chip, OSCCON + 1u, OSC_FRC_PLL);
    assert_int_equal(get(OSCCON) >> OSCCON_NOSC_SHIFT & 7u, 0);
    dspic_byte_write(bench.chip, OSCCON, OSCCON_OSWEN); /* too late now */
    assert_false(get(OSCCON) & OSCCON_OSWEN);
}

static void a_pll_that_does_not_lock_leaves_the_chip_on_its_old_clock(void **state)
{
    (void)state;
    struct dspic_parameters parameters = standard();
    parameters.pll_failures = 1;
    power(&parameters);
    pll();
    pass(100u * MS);
    assert_true(get(OSCCON) & OSCCON_OSWEN);
    assert_false(get(OSCCON) & OSCCON_LOCK);
    assert_int_equal(dspic_fcy_hz(bench.chip), FRC_HZ / 2u);
    dspic_disturb_reset(bench.chip, RCON_EXTR);
    pll();
    pass(3u * MS);
    assert_true(get(OSCCON) & OSCCON_LOCK); /* the second time it does */
}

static void pll_input_and_oscillator_out_of_range_are_noticed(void **state)
{
    (void)state;
    put(PLLFBD, 10); /* M 12: 44 MHz, below the oscillator's 100 */
    put(CLKDIV, 0);
    osccon(1, OSCCON_HIGH_KEY1, OSCCON_HIGH_KEY2, OSC_FRC_PLL);
    osccon(0, OSCCON_LOW_KEY1, OSCCON_LOW_KEY2, OSCCON_OSWEN);
    pass(3u * MS);
    assert_int_equal(dspic_violations(bench.chip).overclocked, 1);
}

static void the_oscillators_error_is_the_clocks(void **state)
{
    (void)state;
    struct dspic_parameters parameters = standard();
    parameters.frc_ppm = -20000;
    power(&parameters);
    assert_in_range(dspic_fcy_hz(bench.chip), FRC_HZ / 2u / 100u * 98u - 5u, FRC_HZ / 2u / 100u * 98u + 5u);
}

static void the_watchdog_sleeps_until_it_is_switched_on(void **state)
{
    (void)state;
    pass(1000u * MS);
    assert_int_equal(bench.starts, 1);
}

static void the_watchdog_wakes_an_idle_cpu_and_lets_it_go_on(void **state)
{
    (void)state;
    set(RCON, RCON_SWDTEN);
    clear(RCON, RCON_POR | RCON_BOR);
    pass(100u * MS);
    dspic_idle(bench.chip); /* begins its time anew */
    pass(100u * MS);
    assert_int_equal(bench.loops, 0);
    pass(50u * MS);
    assert_int_equal(bench.loops, 1);
    assert_int_equal(bench.starts, 1);
    assert_int_equal(get(RCON), RCON_SWDTEN | RCON_WDTO | RCON_IDLE);
}

static void what_wakes_the_cpu_begins_the_watchdogs_time_anew(void **state)
{
    (void)state;
    set(RCON, RCON_SWDTEN);
    enable(IRQ_T1, 4);
    put(PR1, 46062); /* 100 ms at 8 cycles a count */
    put(T1CON, TCON_TON | 1u << TCON_TCKPS_SHIFT);
    dspic_idle(bench.chip);
    pass(101u * MS);
    assert_int_equal(bench.loops, 1);
    pass(100u * MS);
    assert_int_equal(bench.starts, 1);
    pass(60u * MS);
    assert_int_equal(bench.starts, 2);
}

static void a_clock_switch_begins_the_watchdogs_time_anew(void **state)
{
    (void)state;
    struct dspic_parameters parameters = standard();
    parameters.pll_lock_us = 50000;
    power(&parameters);
    set(RCON, RCON_SWDTEN);
    pass(60u * MS);
    pll(); /* done 110 ms after the watchdog began */
    pass(170u * MS);
    assert_int_equal(bench.starts, 1);
    pass(20u * MS);
    assert_int_equal(bench.starts, 2);
}

static void the_watchdog_resets_an_idle_cpu_that_stands_still(void **state)
{
    (void)state;
    set(RCON, RCON_SWDTEN);
    dspic_idle(bench.chip);
    dspic_disturb_hang(bench.chip);
    pass(200u * MS);
    assert_int_equal(bench.starts, 2);
}

static void idle_again(struct bench *b, unsigned irq)
{
    (void)irq;
    dspic_idle(b->chip);
}

static void the_watchdog_resets_a_cpu_that_idles_in_an_interrupt(void **state)
{
    (void)state;
    set(RCON, RCON_SWDTEN);
    bench.within = idle_again;
    enable(IRQ_T1, 4);
    flag(IRQ_T1);
    pass(200u * MS);
    assert_int_equal(bench.served[IRQ_T1], 1);
    assert_true(get(RCON) & RCON_WDTO);
}

static void a_reset_restores_the_registers_and_adds_its_cause(void **state)
{
    (void)state;
    master();
    put(TRISB, 0);
    enable(IRQ_T1, 7);
    put(T1CON, TCON_TON);
    put(RCON, RCON_SWR);
    dspic_disturb_reset(bench.chip, RCON_EXTR);
    assert_int_equal(get(RCON), RCON_SWR | RCON_EXTR);
    assert_int_equal(get(TRISB), 0xFFFF);
    assert_int_equal(get(SPI1STAT) | get(SPI1CON1) | get(T1CON) | get(IEC0), 0);
    assert_int_equal(get(IPC0), 0x4444);
    assert_int_equal(dspic_output(bench.chip, SCK_PIN), DSPIC_FLOAT);
}

static void a_reset_leaves_the_oscillator_as_the_parameter_says_and_never_its_divisors(void **state)
{
    (void)state;
    struct dspic_parameters parameters = standard();
    for (unsigned keeps = 0; keeps < 2u; keeps++) {
        parameters.keeps_clock = keeps;
        power(&parameters);
        pll();
        pass(3u * MS);
        dspic_disturb_reset(bench.chip, RCON_EXTR);
        assert_int_equal(get(OSCCON) >> OSCCON_COSC_SHIFT & 7u, keeps ? OSC_FRC_PLL : OSC_FRC);
        assert_int_equal(get(PLLFBD), 48);
        assert_int_equal(get(CLKDIV), 0x0040);
        assert_int_equal(dspic_fcy_hz(bench.chip), keeps ? 23031250 : FRC_HZ / 2u); /* 7.37 MHz / 2 * 50 / 4 / 2 */
        dspic_disturb_reset(bench.chip, RCON_BOR);
        assert_int_equal(get(OSCCON) >> OSCCON_COSC_SHIFT & 7u, OSC_FRC);
    }
}

static void divisors_changed_while_the_pll_runs_the_chip_are_noticed(void **state)
{
    (void)state;
    pll();
    pass(3u * MS);
    assert_int_equal(dspic_violations(bench.chip).pll_running, 0);
    put(PLLFBD, 41);
    put(CLKDIV, 1);
    assert_int_equal(dspic_violations(bench.chip).pll_running, 2);
}

static void without_power_nothing_runs_and_nothing_is_driven(void **state)
{
    (void)state;
    master();
    put(T1CON, TCON_TON);
    dspic_power_off(bench.chip, dspic_now_fs(bench.chip));
    assert_false(dspic_powered(bench.chip));
    assert_int_equal(dspic_next_fs(bench.chip), UINT64_MAX);
    assert_int_equal(dspic_output(bench.chip, SCK_PIN), DSPIC_FLOAT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(the_clock_switches_only_behind_its_keys),
        TEST(more_than_40_mips_is_noticed),
        TEST(the_watchdog_resets_a_firmware_that_forgets_it),
        TEST(resets_report_their_cause),
        TEST(a_reset_ends_the_interrupt_it_is_called_from),
        TEST(a_pause_between_the_keys_voids_them),
        TEST(the_keys_of_one_half_do_not_open_the_other),
        TEST(a_pll_that_does_not_lock_leaves_the_chip_on_its_old_clock),
        TEST(pll_input_and_oscillator_out_of_range_are_noticed),
        TEST(the_oscillators_error_is_the_clocks),
        TEST(the_watchdog_sleeps_until_it_is_switched_on),
        TEST(the_watchdog_wakes_an_idle_cpu_and_lets_it_go_on),
        TEST(what_wakes_the_cpu_begins_the_watchdogs_time_anew),
        TEST(a_clock_switch_begins_the_watchdogs_time_anew),
        TEST(the_watchdog_resets_an_idle_cpu_that_stands_still),
        TEST(the_watchdog_resets_a_cpu_that_idles_in_an_interrupt),
        TEST(a_reset_restores_the_registers_and_adds_its_cause),
        TEST(a_reset_leaves_the_oscillator_as_the_parameter_says_and_never_its_divisors),
        TEST(divisors_changed_while_the_pll_runs_the_chip_are_noticed),
        TEST(without_power_nothing_runs_and_nothing_is_driven),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
