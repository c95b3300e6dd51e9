/* Port, open drain, pin select: each documented side effect, one test of its own. */
#include "bench.h"

static void a_locked_pin_map_stays_and_locks_but_once(void **state)
{
    (void)state;
    put(RPINR23, 3);
    osccon(0, OSCCON_LOW_KEY1, OSCCON_LOW_KEY2, OSCCON_IOLOCK);
    put(RPINR23, 4);
    assert_int_equal(get(RPINR23), 3);
    osccon(0, OSCCON_LOW_KEY1, OSCCON_LOW_KEY2, 0);
    put(RPINR23, 4);
    assert_int_equal(get(RPINR23), 3);
    assert_int_equal(dspic_violations(bench.chip).pins_locked, 2);
}

static void an_input_tied_to_ground_reads_low(void **state)
{
    (void)state;
    master();
    dspic_wire(bench.chip, SDI_PIN, true);
    put(SPI1BUF, 0);
    pass(400u * US);
    assert_int_equal(get(SPI1BUF), 0xFF);
    put(RPINR20, RP_GROUND | SCK_PIN << 8);
    put(SPI1BUF, 0);
    pass(400u * US);
    assert_int_equal(get(SPI1BUF), 0);
}

static void inputs_are_tied_to_ground_until_they_are_mapped(void **state)
{
    (void)state;
    for (unsigned n = 0; n <= 26u; n++)
        assert_int_equal(get((uint16_t)(RPINR0 + 2u * n)), 0x1F1F);
    enable(IRQ_INT1, 4);
    dspic_input(bench.chip, SYNC_PIN, true, dspic_now_fs(bench.chip));
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_INT1], 0);
}

static void locked(uint8_t bit)
{
    osccon(0, OSCCON_LOW_KEY1, OSCCON_LOW_KEY2, bit);
}

static void where_the_configuration_allows_a_map_unlocks_again(void **state)
{
    (void)state;
    struct dspic_parameters parameters = standard();
    parameters.pins_lock_once = false;
    power(&parameters);
    locked(OSCCON_IOLOCK);
    put(RPINR23, 4);
    assert_int_not_equal(get(RPINR23), 4);
    locked(0);
    put(RPINR23, 4);
    assert_int_equal(get(RPINR23), 4);
}

static void the_lock_itself_wants_its_keys(void **state)
{
    (void)state;
    osccon(0, OSCCON_LOW_KEY1, 0, OSCCON_IOLOCK);
    put(RPINR23, 4);
    assert_int_equal(get(RPINR23), 4);
}

static void a_locked_map_of_outputs_stays_too(void **state)
{
    (void)state;
    locked(OSCCON_IOLOCK);
    put(RPOR0, RP_SDO1);
    assert_int_equal(get(RPOR0), 0);
    assert_int_equal(dspic_violations(bench.chip).pins_locked, 1);
}

static void a_reset_unlocks_the_map(void **state)
{
    (void)state;
    locked(OSCCON_IOLOCK);
    dspic_disturb_reset(bench.chip, RCON_EXTR);
    put(RPINR23, 4);
    assert_int_equal(get(RPINR23), 4);
}

static void an_open_drain_output_pulls_low_or_lets_go(void **state)
{
    (void)state;
    put(ODCB, 1u << SYNC_PIN);
    put(LATB, 1u << SYNC_PIN);
    put(TRISB, (uint16_t) ~(1u << SYNC_PIN));
    assert_int_equal(dspic_output(bench.chip, SYNC_PIN), DSPIC_FLOAT);
    put(LATB, 0);
    assert_int_equal(dspic_output(bench.chip, SYNC_PIN), DSPIC_LOW);
    put(ODCB, 0);
    put(LATB, 1u << SYNC_PIN);
    assert_int_equal(dspic_output(bench.chip, SYNC_PIN), DSPIC_HIGH);
}

static void pins_start_as_inputs(void **state)
{
    (void)state;
    put(LATB, 0xFFFF);
    for (unsigned rp = 0; rp < 16u; rp++)
        assert_int_equal(dspic_output(bench.chip, rp), DSPIC_FLOAT);
}

static void the_port_reads_its_pins_the_latch_what_was_written(void **state)
{
    (void)state;
    put(TRISB, 0xFFFE);
    put(LATB, 3);
    dspic_input(bench.chip, 2, true, dspic_now_fs(bench.chip));
    assert_int_equal(get(LATB), 3);
    assert_int_equal(get(PORTB), 1u << 0 | 1u << 2);
    put(PORTB, 0); /* writes the latch */
    assert_int_equal(get(LATB), 0);
}

static void a_module_takes_its_pin_from_the_port_while_it_is_on(void **state)
{
    (void)state;
    clear(TRISB, 1u << SCK_PIN);
    set(LATB, 1u << SCK_PIN);
    assert_int_equal(dspic_output(bench.chip, SCK_PIN), DSPIC_HIGH);
    master();
    assert_int_equal(dspic_output(bench.chip, SCK_PIN), DSPIC_LOW);
    put(SPI1STAT, 0);
    assert_int_equal(dspic_output(bench.chip, SCK_PIN), DSPIC_HIGH);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_locked_pin_map_stays_and_locks_but_once),
        TEST(an_input_tied_to_ground_reads_low),
        TEST(inputs_are_tied_to_ground_until_they_are_mapped),
        TEST(where_the_configuration_allows_a_map_unlocks_again),
        TEST(the_lock_itself_wants_its_keys),
        TEST(a_locked_map_of_outputs_stays_too),
        TEST(a_reset_unlocks_the_map),
        TEST(an_open_drain_output_pulls_low_or_lets_go),
        TEST(pins_start_as_inputs),
        TEST(the_port_reads_its_pins_the_latch_what_was_written),
        TEST(a_module_takes_its_pin_from_the_port_while_it_is_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
