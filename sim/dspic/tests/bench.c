#include "bench.h"

#include <string.h>

struct bench bench;

static void on_pin(void *context, unsigned rp, enum dspic_drive drive, uint64_t now_fs)
{
    struct bench *b = context;
    if (rp != SCK_PIN)
        return;
    b->rises += drive == DSPIC_HIGH;
    b->falls += drive == DSPIC_LOW;
    if (drive == DSPIC_HIGH)
        b->rise_fs = now_fs;
    else
        b->sent = b->sent << 1 | (dspic_output(b->chip, SDO_PIN) == DSPIC_HIGH);
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
    struct bench *b = context;
    (void)trap;
    b->traps++;
    if (b->trapping)
        b->trapping(b);
}

static void on_outside(void *context)
{
    struct bench *b = context;
    b->outside(b);
}

struct dspic_parameters standard(void)
{
    struct dspic_parameters parameters;
    dspic_parameters_default(&parameters);
    return parameters;
}

void make(const struct dspic_parameters *parameters)
{
    const struct dspic_parameters usual = standard();
    dspic_free(bench.chip);
    memset(&bench, 0, sizeof bench);
    bench.chip = dspic_new(parameters ? parameters : &usual, &(struct dspic_wiring){&bench, on_pin, on_start, on_loop,
                                                                                    on_interrupt, on_trap, on_outside});
    assert_non_null(bench.chip);
}

void power(const struct dspic_parameters *parameters)
{
    make(parameters);
    dspic_power_on(bench.chip, 0);
}

int begin(void **state)
{
    (void)state;
    power(NULL);
    return 0;
}

int end(void **state)
{
    (void)state;
    dspic_free(bench.chip);
    bench.chip = NULL;
    return 0;
}

uint16_t get(uint16_t address)
{
    return dspic_sfr_read(bench.chip, address);
}

void put(uint16_t address, uint16_t value)
{
    dspic_sfr_write(bench.chip, address, value);
}

void set(uint16_t address, uint16_t bits)
{
    dspic_sfr_modify(bench.chip, address, bits, bits);
}

void clear(uint16_t address, uint16_t bits)
{
    dspic_sfr_modify(bench.chip, address, bits, 0);
}

void enable(unsigned irq, unsigned priority)
{
    const unsigned shift = 4u * (irq % 4u);
    dspic_sfr_modify(bench.chip, (uint16_t)(IPC0 + 2u * (irq / 4u)), (uint16_t)(7u << shift),
                     (uint16_t)(priority << shift));
    set((uint16_t)(IEC0 + 2u * (irq / 16u)), (uint16_t)(1u << irq % 16u));
}

void flag(unsigned irq)
{
    set((uint16_t)(IFS0 + 2u * (irq / 16u)), (uint16_t)(1u << irq % 16u));
}

bool flagged(unsigned irq)
{
    return ((unsigned)get((uint16_t)(IFS0 + 2u * (irq / 16u))) >> irq % 16u & 1u) != 0;
}

void pass(uint64_t fs)
{
    dspic_run_until(bench.chip, dspic_now_fs(bench.chip) + fs);
}

void osccon(uint16_t half, uint8_t key1, uint8_t key2, uint8_t value)
{
    dspic_byte_write(bench.chip, (uint16_t)(OSCCON + half), key1);
    dspic_byte_write(bench.chip, (uint16_t)(OSCCON + half), key2);
    dspic_byte_write(bench.chip, (uint16_t)(OSCCON + half), value);
}

void pll(void)
{
    put(PLLFBD, 40);
    put(CLKDIV, 0);
    osccon(1, OSCCON_HIGH_KEY1, OSCCON_HIGH_KEY2, OSC_FRC_PLL);
    osccon(0, OSCCON_LOW_KEY1, OSCCON_LOW_KEY2, OSCCON_OSWEN);
}

uint64_t cycle_fs(void)
{
    return (uint64_t)(1e15 / dspic_fcy_hz(bench.chip));
}

void master(void)
{
    put(RPINR20, SDI_PIN | SCK_PIN << 8);
    put(RPOR0 + 2u * (SCK_PIN / 2u), RP_SCK1);
    put(RPOR0 + 2u * (SDO_PIN / 2u), RP_SDO1 << 8);
    put(SPI1CON1, SPICON1_MSTEN | 7u << SPICON1_SPRE_SHIFT);
    put(SPI1STAT, SPISTAT_SPIEN);
}

void slave(void)
{
    dspic_input(bench.chip, SLAVE_SS, true, 0);
    put(RPINR22, SLAVE_SDI | SLAVE_SCK << 8);
    put(RPINR23, SLAVE_SS);
    put(RPOR0 + 2u * (SLAVE_SDO / 2u), RP_SDO2 << 8);
    put(SPI2CON1, SPICON1_MODE16 | SPICON1_SSEN);
    put(SPI2STAT, SPISTAT_SPIEN);
}

void slave_select(bool low)
{
    dspic_input(bench.chip, SLAVE_SS, !low, dspic_now_fs(bench.chip));
}

uint16_t clock_slave(uint16_t out, unsigned bits)
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

void channel(unsigned n, uint16_t control, uint16_t irq, uint16_t pad, uint16_t items)
{
    const uint16_t at = (uint16_t)(DMA0CON + n * DMA_STRIDE);
    put((uint16_t)(at + DMA0REQ - DMA0CON), irq);
    put((uint16_t)(at + DMA0STA - DMA0CON), (uint16_t)(64u * n));
    put((uint16_t)(at + DMA0STB - DMA0CON), (uint16_t)(64u * n + 16u));
    put((uint16_t)(at + DMA0PAD - DMA0CON), pad);
    put((uint16_t)(at + DMA0CNT - DMA0CON), (uint16_t)(items - 1u));
    put(at, (uint16_t)(control | DMACON_CHEN));
}
