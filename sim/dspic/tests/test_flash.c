/* Flash self-programming: each documented side effect, one test of its own. */
#include "bench.h"

static void flash_do(uint16_t operation, uint32_t word, bool keys)
{
    put(TBLPAG, (uint16_t)(2u * word >> 16));
    dspic_table_write(bench.chip, (uint16_t)(2u * word), false, 0xBEEF);
    dspic_table_write(bench.chip, (uint16_t)(2u * word), true, 0x12);
    put(NVMCON, operation);
    if (keys) {
        put(NVMKEY, NVMKEY_1);
        put(NVMKEY, NVMKEY_2);
    }
    dspic_sfr_modify(bench.chip, NVMCON, NVMCON_WR, NVMCON_WR);
}

static void a_word_is_written_and_a_page_erased_with_the_cpu_stalled(void **state)
{
    (void)state;
    const uint32_t *flash = dspic_flash(bench.chip);
    flash_do(NVMCON_WRITE_WORD, 5000, true);
    assert_int_equal(flash[5000], 0x12BEEF);
    assert_int_equal(flash[5001], 0xFFFFFF);
    const uint64_t before = dspic_now_fs(bench.chip);
    flash_do(NVMCON_ERASE_PAGE, 5000, true);
    assert_in_range(dspic_now_fs(bench.chip) - before, 22u * MS, 24u * MS);
    assert_int_equal(flash[5000], 0xFFFFFF);
    assert_false(get(NVMCON) & NVMCON_WR);
}

static void writing_only_clears_bits(void **state)
{
    (void)state;
    dspic_flash(bench.chip)[100] = 0x0F0F0F;
    flash_do(NVMCON_WRITE_WORD, 100, true);
    assert_int_equal(dspic_flash(bench.chip)[100], 0x0F0F0F & 0x12BEEF);
}

static void flash_is_not_touched_without_its_keys(void **state)
{
    (void)state;
    flash_do(NVMCON_WRITE_WORD, 100, false);
    assert_int_equal(dspic_flash(bench.chip)[100], 0xFFFFFF);
    assert_int_equal(dspic_violations(bench.chip).unlock, 1);
}

static void erase_at_start(struct bench *b)
{
    if (b->starts == 1)
        flash_do(NVMCON_ERASE_PAGE, 1024, true);
}

static void a_power_cut_leaves_a_page_half_erased(void **state)
{
    (void)state;
    make(NULL);
    bench.starting = erase_at_start;
    for (unsigned i = 0; i < FLASH_PAGE_WORDS; i++)
        dspic_flash(bench.chip)[1024 + i] = 0;
    dspic_cut_power_at(bench.chip, 10u * MS);
    dspic_power_on(bench.chip, 0);
    assert_false(dspic_powered(bench.chip));
    assert_int_equal(dspic_flash(bench.chip)[1024], 0xFFFFFF);
    assert_int_equal(dspic_flash(bench.chip)[1024 + FLASH_PAGE_WORDS - 1], 0);
    dspic_power_on(bench.chip, 40u * MS);
    assert_true(dspic_powered(bench.chip));
    assert_int_equal(bench.starts, 2);
}

static void load_row(uint32_t word, uint32_t value)
{
    put(TBLPAG, (uint16_t)(2u * word >> 16));
    for (unsigned i = 0; i < FLASH_ROW_WORDS; i++) {
        dspic_table_write(bench.chip, (uint16_t)(2u * (word + i)), false, (uint16_t)(value + i));
        dspic_table_write(bench.chip, (uint16_t)(2u * (word + i)), true, (uint16_t)(value >> 16));
    }
}

static void start_operation(uint16_t operation)
{
    put(NVMCON, operation);
    put(NVMKEY, NVMKEY_1);
    put(NVMKEY, NVMKEY_2);
    set(NVMCON, NVMCON_WR);
}

static void a_row_is_written_at_once(void **state)
{
    (void)state;
    const uint32_t *flash = dspic_flash(bench.chip);
    load_row(4096, 0x340000);
    const uint64_t before = dspic_now_fs(bench.chip);
    start_operation(NVMCON_WRITE_ROW);
    assert_in_range(dspic_now_fs(bench.chip) - before, 1400u * US, 1600u * US);
    assert_int_equal(flash[4095], 0xFFFFFF);
    for (unsigned i = 0; i < FLASH_ROW_WORDS; i++)
        assert_int_equal(flash[4096 + i], 0x340000 + i);
    assert_int_equal(flash[4096 + FLASH_ROW_WORDS], 0xFFFFFF);
}

static void the_holding_buffers_are_empty_after_an_operation(void **state)
{
    (void)state;
    load_row(4096, 0x340000);
    start_operation(NVMCON_WRITE_ROW);
    dspic_table_write(bench.chip, 2u * 4160u, false, 0xFFFF);
    start_operation(NVMCON_WRITE_ROW);
    for (unsigned i = 0; i < FLASH_ROW_WORDS; i++)
        assert_int_equal(dspic_flash(bench.chip)[4160 + i], 0xFFFFFF);
}

static void keys_in_another_order_do_nothing(void **state)
{
    (void)state;
    load_row(4096, 0);
    put(NVMCON, NVMCON_WRITE_ROW);
    put(NVMKEY, NVMKEY_2);
    put(NVMKEY, NVMKEY_1);
    set(NVMCON, NVMCON_WR);
    assert_int_equal(dspic_flash(bench.chip)[4096], 0xFFFFFF);
    assert_int_equal(dspic_violations(bench.chip).unlock, 1);
}

static void one_use_of_the_keys_is_all_there_is(void **state)
{
    (void)state;
    load_row(4096, 0);
    start_operation(NVMCON_WRITE_ROW);
    load_row(4160, 0);
    set(NVMCON, NVMCON_WR);
    assert_int_equal(dspic_flash(bench.chip)[4160], 0xFFFFFF);
}

static void pulse_sync(struct bench *b)
{
    dspic_input(b->chip, SYNC_PIN, true, dspic_now_fs(b->chip));
    dspic_input(b->chip, SYNC_PIN, false, dspic_now_fs(b->chip));
}

/* A word's write with an interrupt between its keys, held off or not. */
static void write_disturbed(bool held)
{
    put(RPINR0, SYNC_PIN << 8);
    enable(IRQ_INT1, 4);
    bench.outside = pulse_sync;
    load_row(4096, 0);
    put(NVMCON, NVMCON_WRITE_ROW);
    if (held)
        dspic_hold_interrupts(bench.chip, 5);
    put(NVMKEY, NVMKEY_1);
    dspic_outside_at(bench.chip, dspic_now_fs(bench.chip) + cycle_fs() / 2u);
    put(NVMKEY, NVMKEY_2);
    set(NVMCON, NVMCON_WR);
    pass(1u * MS);
    assert_int_equal(bench.served[IRQ_INT1], 1);
}

static void an_interrupt_between_the_keys_voids_them(void **state)
{
    (void)state;
    write_disturbed(false);
    assert_int_equal(dspic_flash(bench.chip)[4096], 0xFFFFFF);
    assert_int_equal(dspic_violations(bench.chip).unlock, 1);
}

static void disi_keeps_the_keys_together(void **state)
{
    (void)state;
    write_disturbed(true);
    assert_int_equal(dspic_flash(bench.chip)[4096], 0);
    assert_int_equal(dspic_violations(bench.chip).unlock, 0);
}

/* The timer meets its period 22 times in the erase: one flag, one interrupt after it. */
static void interrupts_wait_out_the_stall_and_timers_do_not(void **state)
{
    (void)state;
    put(PR1, 3684); /* 1 ms */
    enable(IRQ_T1, 4);
    put(T1CON, TCON_TON);
    flash_do(NVMCON_ERASE_PAGE, 5000, true);
    pass(50u * US);
    assert_int_equal(bench.served[IRQ_T1], 1);
    pass(2u * MS);
    assert_int_equal(bench.served[IRQ_T1], 3);
}

static void clock_a_word(struct bench *b)
{
    (void)b;
    clock_slave(0xABCD, 16);
    dspic_outside_at(bench.chip, dspic_now_fs(bench.chip) + 4u * MS);
}

/* DMA goes on, the CPU does not: its channel done, the slave's buffer stays full, and the word after overflows. */
static void a_slave_overflows_in_the_stall_once_its_channel_is_done(void **state)
{
    (void)state;
    slave();
    channel(1, DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 2);
    slave_select(true);
    bench.outside = clock_a_word;
    dspic_outside_at(bench.chip, dspic_now_fs(bench.chip) + 3u * MS);
    flash_do(NVMCON_ERASE_PAGE, 5000, true); /* words at 3, 7, 11, 15, 19 ms */
    assert_memory_equal(dspic_dma_ram(bench.chip) + 32, ((uint16_t[]){0xABCD, 0xABCD, 0}), 6);
    assert_true(flagged(IRQ_DMA1));
    assert_true(flagged(IRQ_SPI2_ERROR));
    assert_true(get(SPI2STAT) & SPISTAT_SPIROV);
}

static void the_chip_reports_its_id_and_its_number(void **state)
{
    (void)state;
    struct dspic_parameters parameters = standard();
    parameters.serial = 0x04030201;
    parameters.device_id = 0x062A;
    power(&parameters);
    put(TBLPAG, DEVID_PAGE);
    assert_int_equal(dspic_table_read(bench.chip, DEVID_OFFSET, false), 0x062A);
    put(TBLPAG, CONFIG_PAGE);
    for (uint16_t i = 0; i < 4u; i++)
        assert_int_equal(dspic_table_read(bench.chip, (uint16_t)(FUID0_OFFSET + 2u * i), false) & 0xFFu, i + 1u);
}

static void the_high_byte_of_a_word_reads_apart(void **state)
{
    (void)state;
    dspic_flash(bench.chip)[0x9000] = 0x123456;
    put(TBLPAG, 1);
    assert_int_equal(dspic_table_read(bench.chip, 0x2000, false), 0x3456);
    assert_int_equal(dspic_table_read(bench.chip, 0x2000, true), 0x12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_word_is_written_and_a_page_erased_with_the_cpu_stalled),
        TEST(writing_only_clears_bits),
        TEST(flash_is_not_touched_without_its_keys),
        TEST(a_power_cut_leaves_a_page_half_erased),
        TEST(a_row_is_written_at_once),
        TEST(the_holding_buffers_are_empty_after_an_operation),
        TEST(keys_in_another_order_do_nothing),
        TEST(one_use_of_the_keys_is_all_there_is),
        TEST(an_interrupt_between_the_keys_voids_them),
        TEST(disi_keeps_the_keys_together),
        TEST(interrupts_wait_out_the_stall_and_timers_do_not),
        TEST(a_slave_overflows_in_the_stall_once_its_channel_is_done),
        TEST(the_chip_reports_its_id_and_its_number),
        TEST(the_high_byte_of_a_word_reads_apart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
