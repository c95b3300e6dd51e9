/* The register file: every access takes a cycle, some have side effects. */
#include "dspic_chip.h"

static bool dspic_registers_within(unsigned address, unsigned first, unsigned last)
{
    return address >= first && address <= last;
}

uint16_t registers_read(struct dspic *chip, unsigned address)
{
    switch (address) {
    case SPI1BUF:
    case SPI2BUF:
        return spi_read_buffer(chip, address == SPI2BUF);
    case TMR1:
        return timer_count(chip, 0);
    case TMR2:
        return timer_count(chip, 1);
    case TMR3:
        return timer_count(chip, 2);
    case PORTB: {
        uint16_t pins = chip->inputs;
        for (unsigned rp = 0; rp < 16u; rp++) {
            if (chip->drive[rp] != DSPIC_FLOAT)
                pins = (uint16_t)((pins & ~(1u << rp)) | (unsigned)(chip->drive[rp] == DSPIC_HIGH) << rp);
        }
        return pins;
    }
    default:
        return *dspic_chip_sfr(chip, address);
    }
}

static void dspic_registers_keep_pin_map(struct dspic *chip, unsigned address, uint16_t old)
{
    if (*dspic_chip_sfr(chip, OSCCON) & OSCCON_IOLOCK) {
        chip->violations.pins_locked++;
        *dspic_chip_sfr(chip, address) = old;
    }
    pins_refresh(chip);
}

static void dspic_registers_wrote(struct dspic *chip, unsigned address, uint16_t old)
{
    if (dspic_registers_within(address, SPI1STAT, SPI1BUF))
        spi_wrote(chip, 0, address, old);
    else if (dspic_registers_within(address, SPI2STAT, SPI2BUF))
        spi_wrote(chip, 1, address, old);
    else if (dspic_registers_within(address, DMA0CON, DMACS0 - 2u))
        dma_wrote(chip, address, old);
    else if (dspic_registers_within(address, TMR1, T3CON))
        timer_wrote(chip, address, old);
    else if (dspic_registers_within(address, RPINR0, RPOR0 + 14u))
        dspic_registers_keep_pin_map(chip, address, old);
    else if (dspic_registers_within(address, TRISB, ODCB))
        pins_refresh(chip);
    else if (address == NVMCON || address == NVMKEY)
        flash_wrote(chip, address, old);
    else if (address == RCON && (*dspic_chip_sfr(chip, RCON) ^ old) & RCON_SWDTEN)
        dspic_watchdog_restart(chip);
    else if (address == SR || dspic_registers_within(address, INTCON1, IPC0 + 2u * (IRQ_COUNT / 4u)))
        chip->look = true;
    else if ((address == PLLFBD || address == CLKDIV) && *dspic_chip_sfr(chip, address) != old)
        chip->violations.pll_running += system_runs_on_pll(chip);
    else if (address == OSCCON) { /* only byte by byte, behind the unlock sequences */
        chip->violations.unlock++;
        *dspic_chip_sfr(chip, OSCCON) = old;
    }
}

void registers_write(struct dspic *chip, unsigned address, uint16_t value)
{
    const uint16_t old = *dspic_chip_sfr(chip, address);
    const unsigned target = address == PORTB ? LATB : address;
    *dspic_chip_sfr(chip, target) = value;
    dspic_registers_wrote(chip, target, old);
}

uint16_t dspic_sfr_read(struct dspic *chip, uint16_t address)
{
    const uint16_t value = registers_read(chip, address);
    dspic_spend(chip, 1u);
    return value;
}

/* What the firmware computes before this write takes its time first. */
static void dspic_registers_compute_first(struct dspic *chip, uint16_t address)
{
    if (address != chip->computed_for)
        return;
    chip->computed_for = 0;
    if (chip->computed_fs > chip->now_fs)
        dspic_compute(chip, (chip->computed_fs - chip->now_fs) / chip->cycle_fs);
}

void dspic_sfr_write(struct dspic *chip, uint16_t address, uint16_t value)
{
    dspic_registers_compute_first(chip, address);
    registers_write(chip, address, value);
    dspic_spend(chip, 1u);
}

void dspic_sfr_modify(struct dspic *chip, uint16_t address, uint16_t mask, uint16_t value)
{
    dspic_registers_compute_first(chip, address);
    registers_write(chip, address, (uint16_t)((*dspic_chip_sfr(chip, address) & ~mask) | value));
    dspic_spend(chip, 1u);
}

static void dspic_registers_osccon_high(struct dspic *chip, uint8_t value)
{
    uint16_t *osccon = dspic_chip_sfr(chip, OSCCON);
    *osccon = (uint16_t)((*osccon & ~(7u << OSCCON_NOSC_SHIFT)) | (value & 7u) << OSCCON_NOSC_SHIFT);
}

enum { SWITCH_CYCLES = 10 }; /* (C) */

static void dspic_registers_osccon_low(struct dspic *chip, uint8_t value)
{
    uint16_t *osccon = dspic_chip_sfr(chip, OSCCON);
    const bool was_locked = *osccon & OSCCON_IOLOCK;
    chip->pins_were_locked |= was_locked;
    *osccon = (uint16_t)((*osccon & ~(OSCCON_OSWEN | OSCCON_IOLOCK)) | (value & (OSCCON_OSWEN | OSCCON_IOLOCK)));
    if (chip->parameters.pins_lock_once && chip->pins_were_locked)
        *osccon |= OSCCON_IOLOCK;
    if (!(*osccon & OSCCON_OSWEN))
        return;
    if ((*osccon >> OSCCON_NOSC_SHIFT & 7u) != OSC_FRC_PLL) /* the plain oscillator runs already */
        dspic_plan_event(chip, EVENT_PLL, chip->now_fs + SWITCH_CYCLES * chip->cycle_fs);
    else if (chip->pll_failed < chip->parameters.pll_failures)
        chip->pll_failed++;
    else
        dspic_plan_event(chip, EVENT_PLL, chip->now_fs + chip->parameters.pll_lock_us * (DSPIC_FS_PER_NS * 1000u));
}

/* One step of an unlock sequence: two keys, then the value, to the same byte in back-to-back instructions (A). True
 * when this is the value. */
static bool dspic_registers_unlock(struct dspic *chip, uint8_t *step, uint8_t value, uint8_t key1, uint8_t key2)
{
    const uint8_t before = dspic_chip_key_in_time(chip, 1u) ? *step : 0u;
    const bool second = before == 1u && value == key2, first = before < 2u && value == key1;
    *step = second ? 2u : first ? 1u : 0u;
    return before == 2u;
}

void dspic_byte_write(struct dspic *chip, uint16_t address, uint8_t value)
{
    if (address == OSCCON + 1u &&
        dspic_registers_unlock(chip, &chip->high_key, value, OSCCON_HIGH_KEY1, OSCCON_HIGH_KEY2))
        dspic_registers_osccon_high(chip, value);
    else if (address == OSCCON && dspic_registers_unlock(chip, &chip->low_key, value, OSCCON_LOW_KEY1, OSCCON_LOW_KEY2))
        dspic_registers_osccon_low(chip, value);
    dspic_spend(chip, 1u);
}

uint16_t *dspic_dma_ram(struct dspic *chip)
{
    return chip->dma_ram;
}
