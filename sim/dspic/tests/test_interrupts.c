/* Interrupts, traps and idle: each documented side effect, one test of its own. */
#include "bench.h"

static void sync_is_taken_on_its_edge_after_the_latency(void **state)
{
    (void)state;
    put(RPINR0, 12u << 8);
    enable(IRQ_INT1, 4);
    const uint64_t at = dspic_now_fs(bench.chip) + 50u * US;
    dspic_input(bench.chip, 12, true, at);
    pass(10u * US);
    assert_int_equal(bench.served[IRQ_INT1], 1);
    const uint64_t cycle = (uint64_t)(1e15 / dspic_fcy_hz(bench.chip));
    assert_in_range(bench.served_fs, at + 4u * cycle, at + 6u * cycle);
    dspic_input(bench.chip, 12, false, dspic_now_fs(bench.chip));
    pass(10u * US);
    assert_int_equal(bench.served[IRQ_INT1], 1);
    assert_int_equal(bench.loops, 1);
}

static void raise_two(struct bench *b, unsigned irq)
{
    if (irq == IRQ_T1)
        dspic_sfr_modify(b->chip, IFS0, 1u << IRQ_T2 | 1u << IRQ_SPI1, 1u << IRQ_T2 | 1u << IRQ_SPI1);
}

static void higher_priorities_nest_equal_ones_wait(void **state)
{
    (void)state;
    bench.within = raise_two;
    enable(IRQ_T1, 3);
    enable(IRQ_T2, 3);
    enable(IRQ_SPI1, 5);
    dspic_sfr_modify(bench.chip, IFS0, 1u << IRQ_T1, 1u << IRQ_T1);
    pass(1u * MS);
    assert_int_equal(bench.order[0], IRQ_T1);
    assert_int_equal(bench.order[1], IRQ_SPI1);
    assert_int_equal(bench.order[2], IRQ_T2);
    assert_int_equal(bench.loops, 1);
}

static void the_lower_number_goes_first_among_equals(void **state)
{
    (void)state;
    dspic_sfr_modify(bench.chip, IFS0, 1u << IRQ_SPI1 | 1u << IRQ_T2, 1u << IRQ_SPI1 | 1u << IRQ_T2);
    enable(IRQ_SPI1, 0);
    enable(IRQ_T2, 0);
    put(IPC0 + 2u, 0x4444);
    put(IPC0 + 4u, 0x4444);
    pass(1u * MS);
    assert_int_equal(bench.order[0], IRQ_T2);
    assert_int_equal(bench.order[1], IRQ_SPI1);
}

static void priority_nought_is_never_taken(void **state)
{
    (void)state;
    enable(IRQ_T1, 0);
    dspic_sfr_modify(bench.chip, IFS0, 1u << IRQ_T1, 1u << IRQ_T1);
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_T1], 0);
}

static void edge(unsigned pin, bool level)
{
    dspic_input(bench.chip, pin, level, dspic_now_fs(bench.chip));
    pass(10u * US);
}

static void the_external_interrupts_take_the_edge_that_is_chosen(void **state)
{
    (void)state;
    put(RPINR0, SYNC_PIN << 8);
    put(RPINR1, SLAVE_SS);
    enable(IRQ_INT1, 4);
    enable(IRQ_INT2, 4);
    edge(SYNC_PIN, true);
    edge(SLAVE_SS, true);
    edge(SYNC_PIN, false);
    edge(SLAVE_SS, false);
    assert_int_equal(bench.served[IRQ_INT1], 1);
    assert_int_equal(bench.served[IRQ_INT2], 1);
    put(INTCON2, INTCON2_INT1EP);
    edge(SYNC_PIN, true);
    edge(SLAVE_SS, true);
    assert_int_equal(bench.served[IRQ_INT1], 1); /* now the falling one */
    assert_int_equal(bench.served[IRQ_INT2], 2); /* still the rising one */
    edge(SYNC_PIN, false);
    assert_int_equal(bench.served[IRQ_INT1], 2);
    put(INTCON2, INTCON2_INT2EP);
    edge(SLAVE_SS, false);
    assert_int_equal(bench.served[IRQ_INT2], 3);
}

static void a_flag_set_while_disabled_is_taken_once_enabled(void **state)
{
    (void)state;
    put(RPINR0, SYNC_PIN << 8);
    edge(SYNC_PIN, true);
    assert_true(flagged(IRQ_INT1));
    assert_int_equal(bench.served[IRQ_INT1], 0);
    enable(IRQ_INT1, 4);
    pass(10u * US);
    assert_int_equal(bench.served[IRQ_INT1], 1);
    assert_false(flagged(IRQ_INT1));
}

static void a_flag_cleared_before_it_is_enabled_is_never_taken(void **state)
{
    (void)state;
    flag(IRQ_T1);
    clear(IFS0, 1u << IRQ_T1);
    enable(IRQ_T1, 4);
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_T1], 0);
}

/* Two edges before the first is served leave one flag: the second is lost. */
static void a_flag_is_no_counter(void **state)
{
    (void)state;
    put(RPINR0, SYNC_PIN << 8);
    for (unsigned i = 0; i < 3; i++) {
        edge(SYNC_PIN, true);
        edge(SYNC_PIN, false);
    }
    enable(IRQ_INT1, 4);
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_INT1], 1);
}

/* An idle CPU at priority 4 and an interrupt of `priority`: how often the main loop went on, and the interrupt came. */
static void wake_by(unsigned priority, unsigned loops, unsigned served)
{
    power(NULL);
    put(SR, 4u << SR_IPL_SHIFT);
    enable(IRQ_T1, priority);
    dspic_idle(bench.chip);
    pass(1u * MS);
    assert_int_equal(bench.loops, 0);
    put(PR1, 99);
    put(T1CON, TCON_TON);
    pass(1u * MS);
    assert_int_equal(bench.loops > 0, loops);
    assert_int_equal(bench.served[IRQ_T1] > 0, served);
    assert_int_equal((get(RCON) & RCON_IDLE) != 0, loops);
    assert_true(served || flagged(IRQ_T1));
}

static void an_interrupt_below_the_cpus_priority_wakes_it_and_waits(void **state)
{
    (void)state;
    wake_by(3, 1, 0);
}

static void an_interrupt_at_the_cpus_priority_wakes_it_and_waits(void **state)
{
    (void)state;
    wake_by(4, 1, 0);
}

static void an_interrupt_above_the_cpus_priority_wakes_it_and_is_served(void **state)
{
    (void)state;
    wake_by(5, 1, 1);
}

static void an_interrupt_of_priority_nought_does_not_even_wake(void **state)
{
    (void)state;
    wake_by(0, 0, 0);
}

static void the_cpus_priority_holds_the_others_back(void **state)
{
    (void)state;
    put(SR, 5u << SR_IPL_SHIFT);
    enable(IRQ_T1, 5);
    enable(IRQ_T2, 6);
    flag(IRQ_T1);
    flag(IRQ_T2);
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_T1], 0);
    assert_int_equal(bench.served[IRQ_T2], 1);
    put(SR, 4u << SR_IPL_SHIFT);
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_T1], 1);
}

static void without_nesting_even_a_higher_one_waits(void **state)
{
    (void)state;
    bench.within = raise_two;
    put(INTCON1, INTCON1_NSTDIS);
    enable(IRQ_T1, 3);
    enable(IRQ_T2, 4);
    enable(IRQ_SPI1, 5);
    flag(IRQ_T1);
    pass(1u * MS);
    assert_memory_equal(bench.order, ((unsigned[]){IRQ_T1, IRQ_SPI1, IRQ_T2}), 3 * sizeof(unsigned));
}

static void disi_holds_back_all_but_the_highest_priority(void **state)
{
    (void)state;
    enable(IRQ_T1, 6);
    enable(IRQ_T2, 7);
    dspic_hold_interrupts(bench.chip, 500);
    flag(IRQ_T1);
    flag(IRQ_T2);
    assert_int_equal(bench.served[IRQ_T1], 0);
    assert_int_equal(bench.served[IRQ_T2], 1);
    pass(600u * cycle_fs()); /* it ends by itself */
    assert_int_equal(bench.served[IRQ_T1], 1);
}

static void each_trap_names_itself(void **state)
{
    (void)state;
    const uint16_t flags[] = {INTCON1_OSCFAIL, INTCON1_STKERR, INTCON1_ADDRERR, INTCON1_MATHERR, INTCON1_DMACERR};
    for (unsigned trap = 0; trap < 5u; trap++) {
        put(INTCON1, 0);
        dspic_disturb_trap(bench.chip, (enum dspic_trap)trap);
        assert_int_equal(get(INTCON1), flags[trap]);
        assert_int_equal(bench.traps, trap + 1u);
    }
}

static void raise_highest(struct bench *b)
{
    flag(IRQ_T1);
    pass(0);
    assert_int_equal(b->served[IRQ_T1], 0);
}

static void trap_now(struct bench *b)
{
    b->outside = NULL;
    dspic_disturb_trap(b->chip, DSPIC_TRAP_OSCILLATOR);
}

/* It comes in at once, whatever the CPU's priority, and nothing comes in while it is handled. */
static void a_trap_stands_above_every_priority(void **state)
{
    (void)state;
    enable(IRQ_T1, 7);
    put(SR, 7u << SR_IPL_SHIFT);
    bench.outside = trap_now;
    bench.trapping = raise_highest;
    dspic_outside_at(bench.chip, dspic_now_fs(bench.chip) + 10u * US);
    pass(20u * US);
    assert_int_equal(bench.traps, 1);
    put(SR, 0);
    pass(10u * US);
    assert_int_equal(bench.served[IRQ_T1], 1);
}

static void a_cpu_that_stands_still_takes_nothing_while_its_timers_count(void **state)
{
    (void)state;
    put(PR1, 99);
    enable(IRQ_T1, 7);
    put(T1CON, TCON_TON);
    dspic_disturb_hang(bench.chip);
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_T1], 0);
    assert_true(flagged(IRQ_T1));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(sync_is_taken_on_its_edge_after_the_latency),
        TEST(higher_priorities_nest_equal_ones_wait),
        TEST(the_lower_number_goes_first_among_equals),
        TEST(priority_nought_is_never_taken),
        TEST(the_external_interrupts_take_the_edge_that_is_chosen),
        TEST(a_flag_set_while_disabled_is_taken_once_enabled),
        TEST(a_flag_cleared_before_it_is_enabled_is_never_taken),
        TEST(a_flag_is_no_counter),
        TEST(an_interrupt_below_the_cpus_priority_wakes_it_and_waits),
        TEST(an_interrupt_at_the_cpus_priority_wakes_it_and_waits),
        TEST(an_interrupt_above_the_cpus_priority_wakes_it_and_is_served),
        TEST(an_interrupt_of_priority_nought_does_not_even_wake),
        TEST(the_cpus_priority_holds_the_others_back),
        TEST(without_nesting_even_a_higher_one_waits),
        TEST(disi_holds_back_all_but_the_highest_priority),
        TEST(each_trap_names_itself),
        TEST(a_trap_stands_above_every_priority),
        TEST(a_cpu_that_stands_still_takes_nothing_while_its_timers_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
