/* Each documented side effect of the chip, one test of its own: registers in, registers and pins out. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <string.h>

#include "dspic.h"

#define US (1000u * DSPIC_FS_PER_NS)
#define MS (1000u * US)
#define SCK_PIN 8u
#define SDI_PIN 9u
#define SLAVE_SCK 13u
#define SLAVE_SDI 14u
#define SLAVE_SDO 15u
#define SLAVE_SS 5u

/* A chip whose firmware is the test. */
struct bench {
    struct dspic *chip;
    unsigned starts, loops, traps;
    unsigned served[IRQ_COUNT];
    unsigned order[8], taken; /* of interrupts */
    uint64_t served_fs;
    unsigned rises, falls; /* of SCK_PIN */
    uint64_t rise_fs;
    void (*within)(struct bench *, unsigned irq); /* more of an interrupt's body */
    void (*starting)(struct bench *);
};

static void on_pin(void *context, unsigned rp, enum dspic_drive drive, uint64_t now_fs)
{
    struct bench *b = context;
    if (rp != SCK_PIN)
        return;
    b->rises += drive == DSPIC_HIGH;
    b->falls += drive == DSPIC_LOW;
    if (drive == DSPIC_HIGH)
        b->rise_fs = now_fs;
}

static void on_start(void *context)
{
    struct bench *b = context;
    b->starts++;
    if (b->starting)
        b->starting(b);
}

static void on_loop(void *context)
{
    ((struct bench *)context)->loops++;
}

static void on_interrupt(void *context, unsigned irq)
{
    struct bench *b = context;
    b->served[irq]++;
    if (b->taken < 8u)
        b->order[b->taken++] = irq;
    b->served_fs = dspic_now_fs(b->chip);
    dspic_sfr_modify(b->chip, (uint16_t)(IFS0 + 2u * (irq / 16u)), (uint16_t)(1u << irq % 16u), 0);
    if (b->within)
        b->within(b, irq);
}

static void on_trap(void *context, enum dspic_trap trap)
{
    (void)trap;
    ((struct bench *)context)->traps++;
}

static struct bench bench;

static void power(const struct dspic_parameters *parameters)
{
    memset(&bench, 0, sizeof bench);
    bench.chip =
        dspic_new(parameters, &(struct dspic_wiring){&bench, on_pin, on_start, on_loop, on_interrupt, on_trap, NULL});
    dspic_power_on(bench.chip, 0);
}

static int begin(void **state)
{
    (void)state;
    struct dspic_parameters parameters;
    dspic_parameters_default(&parameters);
    power(&parameters);
    return 0;
}

static int end(void **state)
{
    (void)state;
    dspic_free(bench.chip);
    return 0;
}

static uint16_t get(uint16_t address)
{
    return dspic_sfr_read(bench.chip, address);
}

static void put(uint16_t address, uint16_t value)
{
    dspic_sfr_write(bench.chip, address, value);
}

static void enable(unsigned irq, unsigned priority)
{
    dspic_sfr_modify(bench.chip, (uint16_t)(IPC0 + 2u * (irq / 4u)), (uint16_t)(7u << 4u * (irq % 4u)),
                     (uint16_t)(priority << 4u * (irq % 4u)));
    dspic_sfr_modify(bench.chip, (uint16_t)(IEC0 + 2u * (irq / 16u)), (uint16_t)(1u << irq % 16u),
                     (uint16_t)(1u << irq % 16u));
}

static bool flagged(unsigned irq)
{
    return ((unsigned)get((uint16_t)(IFS0 + 2u * (irq / 16u))) >> irq % 16u & 1u) != 0;
}

static void pass(uint64_t fs)
{
    dspic_run_until(bench.chip, dspic_now_fs(bench.chip) + fs);
}

static void osccon(uint16_t half, uint8_t key1, uint8_t key2, uint8_t value)
{
    dspic_byte_write(bench.chip, (uint16_t)(OSCCON + half), key1);
    dspic_byte_write(bench.chip, (uint16_t)(OSCCON + half), key2);
    dspic_byte_write(bench.chip, (uint16_t)(OSCCON + half), value);
}

/* SPI1 as master on its pins at FCY / 64. */
static void master(void)
{
    put(RPINR20, SDI_PIN | SCK_PIN << 8);
    put(RPOR0 + 2u * (SCK_PIN / 2u), RP_SCK1);
    put(SPI1CON1, SPICON1_MSTEN | 7u << SPICON1_SPRE_SHIFT);
    put(SPI1STAT, SPISTAT_SPIEN);
}

/* SPI2 as slave in 16-bit words. */
static void slave(void)
{
    dspic_input(bench.chip, SLAVE_SS, true, 0);
    put(RPINR22, SLAVE_SDI | SLAVE_SCK << 8);
    put(RPINR23, SLAVE_SS);
    put(RPOR0 + 2u * (SLAVE_SDO / 2u), RP_SDO2 << 8);
    put(SPI2CON1, SPICON1_MODE16 | SPICON1_SSEN);
    put(SPI2STAT, SPISTAT_SPIEN);
}

static void slave_select(bool low)
{
    dspic_input(bench.chip, SLAVE_SS, !low, dspic_now_fs(bench.chip));
}

/* Clocks `bits` of `out`, top first, into the slave and returns what it sent. */
static uint16_t clock_slave(uint16_t out, unsigned bits)
{
    uint16_t in = 0;
    for (unsigned i = 0; i < bits; i++) {
        dspic_wire(bench.chip, SLAVE_SDI, ((unsigned)out >> (15u - i) & 1u) != 0);
        dspic_input(bench.chip, SLAVE_SCK, true, dspic_now_fs(bench.chip));
        in = (uint16_t)(in << 1 | (dspic_output(bench.chip, SLAVE_SDO) == DSPIC_HIGH));
        dspic_input(bench.chip, SLAVE_SCK, false, dspic_now_fs(bench.chip));
    }
    return in;
}

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

static void an_unread_word_overflows_and_reception_stops_until_told(void **state)
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

/* Depth 2: the first word has left the buffer, so a second fits; depth 1: it waits there. */
static void prefetch_decides_whether_a_second_word_fits(void **state)
{
    (void)state;
    for (uint8_t depth = 1; depth <= 2u; depth++) {
        struct dspic_parameters parameters;
        dspic_parameters_default(&parameters);
        parameters.slave_prefetch = depth;
        dspic_free(bench.chip);
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

static void channel(unsigned n, uint16_t control, uint16_t irq, uint16_t pad, uint16_t items)
{
    const uint16_t at = (uint16_t)(DMA0CON + n * DMA_STRIDE);
    put((uint16_t)(at + DMA0REQ - DMA0CON), irq);
    put((uint16_t)(at + DMA0STA - DMA0CON), (uint16_t)(64u * n));
    put((uint16_t)(at + DMA0STB - DMA0CON), (uint16_t)(64u * n + 16u));
    put((uint16_t)(at + DMA0PAD - DMA0CON), pad);
    put((uint16_t)(at + DMA0CNT - DMA0CON), (uint16_t)(items - 1u));
    put(at, (uint16_t)(control | DMACON_CHEN));
}

static void dma_feeds_and_empties_a_slave_and_stops_after_its_block(void **state)
{
    (void)state;
    slave();
    uint16_t *ram = dspic_dma_ram(bench.chip);
    ram[0] = 0x2222;
    ram[1] = 0x3333;
    channel(0, DMACON_FROM_RAM | DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 2);
    channel(1, DMACON_MODE_ONE_SHOT, IRQ_SPI2, SPI2BUF, 3);
    put(SPI2BUF, 0x1111);
    slave_select(true);
    assert_int_equal(clock_slave(0xA001, 16), 0x1111);
    assert_int_equal(clock_slave(0xA002, 16), 0x2222);
    assert_false(flagged(IRQ_DMA1));
    assert_int_equal(clock_slave(0xA003, 16), 0x3333);
    assert_true(flagged(IRQ_DMA1));
    assert_memory_equal(ram + 32, ((uint16_t[]){0xA001, 0xA002, 0xA003}), 6);
    assert_false(get(DMA0CON + DMA_STRIDE) & DMACON_CHEN);
    clock_slave(0xA004, 16);
    clock_slave(0xA005, 16); /* nobody reads any more */
    assert_true(get(SPI2STAT) & SPISTAT_SPIROV);
    assert_int_equal(ram[35], 0);
}

static void ping_pong_alternates_its_blocks(void **state)
{
    (void)state;
    slave();
    channel(1, DMACON_MODE_PING_PONG, IRQ_SPI2, SPI2BUF, 2);
    slave_select(true);
    for (uint16_t i = 1; i <= 5; i++)
        clock_slave(i, 16);
    const uint16_t *ram = dspic_dma_ram(bench.chip);
    assert_memory_equal(ram + 32, ((uint16_t[]){5, 2}), 4);
    assert_memory_equal(ram + 40, ((uint16_t[]){3, 4}), 4);
}

static void force_moves_one_item(void **state)
{
    (void)state;
    master();
    dspic_dma_ram(bench.chip)[0] = 0x77;
    channel(0, DMACON_FROM_RAM, IRQ_SPI1, SPI1BUF, 4);
    pass(200u * US);
    assert_int_equal(bench.rises, 0); /* the first transfer of a master waits to be asked for */
    put(DMA0REQ, IRQ_SPI1 | DMAREQ_FORCE);
    pass(100u * US);
    assert_true(bench.rises > 0);
    assert_false(get(DMA0REQ) & DMAREQ_FORCE);
}

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

static void resets_tell_their_cause(void **state)
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
    struct dspic_parameters parameters;
    dspic_parameters_default(&parameters);
    dspic_free(bench.chip);
    memset(&bench, 0, sizeof bench);
    bench.chip =
        dspic_new(&parameters, &(struct dspic_wiring){&bench, on_pin, on_start, on_loop, on_interrupt, on_trap, NULL});
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

#define TEST(name) cmocka_unit_test_setup_teardown(name, begin, end)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(reading_the_buffer_clears_its_full_flag),
        TEST(a_byte_takes_eight_clocks_at_the_divided_rate),
        TEST(the_line_is_sampled_on_the_falling_edge),
        TEST(an_unread_word_overflows_and_reception_stops_until_told),
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
        TEST(dma_feeds_and_empties_a_slave_and_stops_after_its_block),
        TEST(ping_pong_alternates_its_blocks),
        TEST(force_moves_one_item),
        TEST(a_timer_counts_prescaled_cycles_to_its_period),
        TEST(sync_is_taken_on_its_edge_after_the_latency),
        TEST(higher_priorities_nest_equal_ones_wait),
        TEST(the_lower_number_goes_first_among_equals),
        TEST(priority_nought_is_never_taken),
        TEST(the_clock_switches_only_behind_its_keys),
        TEST(more_than_40_mips_is_noticed),
        TEST(a_locked_pin_map_stays_and_locks_but_once),
        TEST(the_watchdog_resets_a_firmware_that_forgets_it),
        TEST(resets_tell_their_cause),
        TEST(a_reset_ends_the_interrupt_it_is_called_from),
        TEST(a_word_is_written_and_a_page_erased_with_the_cpu_stalled),
        TEST(writing_only_clears_bits),
        TEST(flash_is_not_touched_without_its_keys),
        TEST(a_power_cut_leaves_a_page_half_erased),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
