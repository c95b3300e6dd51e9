/* SPI1 as master, SPI2 as slave: each documented side effect, one test of its own. */
#include "bench.h"

static void reading_the_buffer_clears_its_full_flag(void **state)
{
    (void)state;
    master();
    put(SPI1BUF, 0xA5);
    pass(200u * US);
    assert_true(get(SPI1STAT) & SPISTAT_SPIRBF);
    get(SPI1BUF);
    assert_false(get(SPI1STAT) & SPISTAT_SPIRBF);
}

static void a_byte_takes_eight_clocks_at_the_divided_rate(void **state)
{
    (void)state;
    master();
    const uint64_t begun = dspic_now_fs(bench.chip);
    put(SPI1BUF, 0);
    pass(400u * US);
    assert_int_equal(bench.rises, 8);
    assert_int_equal(dspic_fcy_hz(bench.chip), FRC_HZ / 2u);
    const double periods = (double)(bench.rise_fs - begun) / (64e15 / dspic_fcy_hz(bench.chip));
    assert_true(periods > 7.4 && periods < 7.6); /* the last rise is half a bit and seven bits after the start */
}

static void the_line_is_sampled_on_the_falling_edge(void **state)
{
    (void)state;
    master();
    dspic_wire(bench.chip, SDI_PIN, true);
    put(SPI1BUF, 0);
    pass(100u * US); /* five bits and a half: 17.4 us each */
    dspic_wire(bench.chip, SDI_PIN, false);
    pass(300u * US);
    assert_int_equal(get(SPI1BUF), 0xF8);
}

static void an_unread_word_overflows_and_reception_stops_until_reported(void **state)
{
    (void)state;
    master();
    for (unsigned i = 0; i < 3; i++) {
        dspic_wire(bench.chip, SDI_PIN, i == 0);
        put(SPI1BUF, 0);
        pass(200u * US);
    }
    assert_true(get(SPI1STAT) & SPISTAT_SPIROV);
    assert_true(flagged(IRQ_SPI1_ERROR));
    assert_int_equal(get(SPI1BUF), 0xFF); /* the first word stays */
    put(SPI1BUF, 0);
    pass(200u * US);
    assert_false(get(SPI1STAT) & SPISTAT_SPIRBF); /* read, yet nothing comes in */
    dspic_sfr_modify(bench.chip, SPI1STAT, SPISTAT_SPIROV, 0);
    put(SPI1BUF, 0);
    pass(200u * US);
    assert_true(get(SPI1STAT) & SPISTAT_SPIRBF);
}

static void software_cannot_set_the_flags_of_the_status(void **state)
{
    (void)state;
    master();
    put(SPI1STAT, SPISTAT_SPIEN | SPISTAT_SPIROV | SPISTAT_SPIRBF);
    assert_int_equal(get(SPI1STAT), SPISTAT_SPIEN);
}

static void a_disabled_module_ignores_writes(void **state)
{
    (void)state;
    master();
    put(SPI1STAT, 0);
    put(SPI1BUF, 0x55);
    pass(200u * US);
    assert_int_equal(bench.rises, 0);
    assert_int_equal(dspic_violations(bench.chip).spi_disabled, 1);
}

static void settings_of_an_enabled_module_stay(void **state)
{
    (void)state;
    master();
    const uint16_t before = get(SPI1CON1);
    put(SPI1CON1, SPICON1_MODE16);
    assert_int_equal(get(SPI1CON1), before);
    assert_int_equal(dspic_violations(bench.chip).spi_settings, 1);
}

static void a_second_word_waits_in_the_buffer_a_third_overwrites_it(void **state)
{
    (void)state;
    master();
    put(SPI1BUF, 1);
    assert_false(get(SPI1STAT) & SPISTAT_SPITBF);
    put(SPI1BUF, 2);
    assert_true(get(SPI1STAT) & SPISTAT_SPITBF);
    put(SPI1BUF, 3);
    assert_int_equal(dspic_violations(bench.chip).spi_overwrite, 1);
}

static void a_slave_sends_what_was_preloaded(void **state)
{
    (void)state;
    slave();
    put(SPI2BUF, 0xC35A);
    slave_select(true);
    assert_int_equal(clock_slave(0x1234, 16), 0xC35A);
    assert_int_equal(get(SPI2BUF), 0x1234);
    assert_true(flagged(IRQ_SPI2));
}

static void a_slave_that_is_not_fed_sends_old_contents_again(void **state)
{
    (void)state;
    slave();
    put(SPI2BUF, 0x8001);
    slave_select(true);
    clock_slave(0, 16);
    get(SPI2BUF);
    assert_int_equal(clock_slave(0, 16), 0x8001);
}

static void prefetch_decides_whether_a_second_word_fits(void **state)
{
    (void)state;
    for (uint8_t depth = 1; depth <= 2u; depth++) {
        struct dspic_parameters parameters = standard();
        parameters.slave_prefetch = depth;
        power(&parameters);
        slave();
        put(SPI2BUF, 0x1111);
        assert_int_equal((get(SPI2STAT) & SPISTAT_SPITBF) != 0, depth == 1u);
        slave_select(true);
        assert_int_equal(clock_slave(0, 16), 0x1111);
    }
}

static void select_brings_bits_back_and_a_broken_word_begins_again(void **state)
{
    (void)state;
    slave();
    put(SPI2BUF, 0xF00F);
    slave_select(true);
    clock_slave(0, 5);
    slave_select(false);
    slave_select(true);
    assert_int_equal(clock_slave(0xBEEF, 16), 0xF00F);
    assert_int_equal(get(SPI2BUF), 0xBEEF);
}

static void a_deselected_slave_lets_its_output_float_and_hears_nothing(void **state)
{
    (void)state;
    slave();
    put(SPI2BUF, 0);
    assert_int_equal(dspic_output(bench.chip, SLAVE_SDO), DSPIC_FLOAT);
    clock_slave(0xFFFF, 16);
    assert_false(get(SPI2STAT) & SPISTAT_SPIRBF);
    slave_select(true);
    assert_int_equal(dspic_output(bench.chip, SLAVE_SDO), DSPIC_LOW);
}

static void switching_off_and_on_loses_bits_and_words(void **state)
{
    (void)state;
    slave();
    put(SPI2BUF, 0xAAAA);
    slave_select(true);
    clock_slave(0xFFFF, 7);
    put(SPI2STAT, 0);
    put(SPI2STAT, SPISTAT_SPIEN);
    put(SPI2BUF, 0x0FF0);
    assert_int_equal(clock_slave(0x7777, 16), 0x0FF0);
    assert_int_equal(get(SPI2BUF), 0x7777);
}

static void a_word_written_over_a_waiting_one_takes_its_place(void **state)
{
    (void)state;
    master();
    put(SPI1BUF, 0x01);
    put(SPI1BUF, 0x02);
    put(SPI1BUF, 0x03);
    pass(400u * US);
    assert_int_equal(bench.rises, 16);
    assert_int_equal(bench.sent & 0xFFFFu, 0x0103);
}

static void sixteen_bits_take_sixteen_clocks(void **state)
{
    (void)state;
    master();
    put(SPI1STAT, 0);
    put(SPI1CON1, get(SPI1CON1) | SPICON1_MODE16);
    put(SPI1STAT, SPISTAT_SPIEN);
    dspic_wire(bench.chip, SDI_PIN, true);
    put(SPI1BUF, 0xA5C3);
    pass(400u * US);
    assert_int_equal(bench.rises, 16);
    assert_int_equal(bench.sent & 0xFFFFu, 0xA5C3);
    assert_int_equal(get(SPI1BUF), 0xFFFF);
}

static void the_secondary_and_primary_dividers_multiply(void **state)
{
    (void)state;
    const struct {
        unsigned primary, secondary, divider;
    } CASES[] = {{3, 6, 2}, {1, 1, 112}, {0, 0, 512}};
    for (unsigned i = 0; i < 3; i++) {
        power(NULL);
        master();
        put(SPI1STAT, 0);
        put(SPI1CON1, (uint16_t)(SPICON1_MSTEN | CASES[i].primary | CASES[i].secondary << SPICON1_SPRE_SHIFT));
        put(SPI1STAT, SPISTAT_SPIEN);
        const uint64_t begun = dspic_now_fs(bench.chip);
        put(SPI1BUF, 0);
        pass(2u * MS);
        const double bits = (double)(bench.rise_fs - begun) / (double)(CASES[i].divider * cycle_fs());
        assert_true(bits > 7.4 && bits < 7.6);
    }
}

static void the_error_interrupt_comes_once_for_all_words_lost(void **state)
{
    (void)state;
    slave();
    enable(IRQ_SPI2_ERROR, 4);
    slave_select(true);
    for (uint16_t word = 1; word <= 5u; word++) {
        clock_slave(word, 16);
        pass(5u * US);
    }
    assert_int_equal(bench.served[IRQ_SPI2_ERROR], 1);
    assert_int_equal(get(SPI2BUF), 1);
}

static void a_slave_that_has_overflowed_still_sends(void **state)
{
    (void)state;
    slave();
    slave_select(true);
    clock_slave(0, 16);
    clock_slave(0, 16);
    assert_true(get(SPI2STAT) & SPISTAT_SPIROV);
    put(SPI2BUF, 0x5AA5);
    clock_slave(0, 16); /* what had moved into the shift register before */
    assert_int_equal(clock_slave(0, 16), 0x5AA5);
}

static void switching_a_master_off_ends_its_word(void **state)
{
    (void)state;
    master();
    put(SPI1BUF, 0x55);
    pass(60u * US);
    const unsigned rises = bench.rises;
    put(SPI1STAT, 0);
    pass(400u * US);
    assert_in_range(rises, 1, 7);
    assert_int_equal(bench.rises, rises);
    put(SPI1STAT, SPISTAT_SPIEN);
    assert_false(get(SPI1STAT) & SPISTAT_SPIRBF);
    assert_false(flagged(IRQ_SPI1));
}

static void an_output_that_is_off_leaves_its_pin_to_the_port(void **state)
{
    (void)state;
    master();
    put(SPI1STAT, 0);
    put(SPI1CON1, get(SPI1CON1) | SPICON1_DISSDO);
    put(SPI1STAT, SPISTAT_SPIEN);
    assert_int_equal(dspic_output(bench.chip, SDO_PIN), DSPIC_FLOAT);
    clear(TRISB, 1u << SDO_PIN);
    set(LATB, 1u << SDO_PIN);
    assert_int_equal(dspic_output(bench.chip, SDO_PIN), DSPIC_HIGH);
}

static void a_module_goes_on_while_the_cpu_idles(void **state)
{
    (void)state;
    master();
    enable(IRQ_SPI1, 4);
    put(SPI1BUF, 0x42);
    dspic_idle(bench.chip);
    pass(400u * US);
    assert_int_equal(bench.served[IRQ_SPI1], 1);
    assert_int_equal(bench.loops, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(reading_the_buffer_clears_its_full_flag),
        TEST(a_byte_takes_eight_clocks_at_the_divided_rate),
        TEST(the_line_is_sampled_on_the_falling_edge),
        TEST(an_unread_word_overflows_and_reception_stops_until_reported),
        TEST(software_cannot_set_the_flags_of_the_status),
        TEST(a_disabled_module_ignores_writes),
        TEST(settings_of_an_enabled_module_stay),
        TEST(a_second_word_waits_in_the_buffer_a_third_overwrites_it),
        TEST(a_slave_sends_what_was_preloaded),
        TEST(a_slave_that_is_not_fed_sends_old_contents_again),
        TEST(prefetch_decides_whether_a_second_word_fits),
        TEST(select_brings_bits_back_and_a_broken_word_begins_again),
        TEST(a_deselected_slave_lets_its_output_float_and_hears_nothing),
        TEST(switching_off_and_on_loses_bits_and_words),
        TEST(a_word_written_over_a_waiting_one_takes_its_place),
        TEST(sixteen_bits_take_sixteen_clocks),
        TEST(the_secondary_and_primary_dividers_multiply),
        TEST(the_error_interrupt_comes_once_for_all_words_lost),
        TEST(a_slave_that_has_overflowed_still_sends),
        TEST(switching_a_master_off_ends_its_word),
        TEST(an_output_that_is_off_leaves_its_pin_to_the_port),
        TEST(a_module_goes_on_while_the_cpu_idles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
