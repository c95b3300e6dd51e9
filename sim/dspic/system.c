/* Resets, clock switch, watchdog. */
#include <string.h>

#include "dspic_chip.h"

enum { LPRC_HZ = 32000 };
static const double FS_PER_S = 1e15;

static double dspic_system_frc_hz(const struct dspic *chip)
{
    return FRC_HZ * (1.0 + chip->parameters.frc_ppm * 1e-6);
}

static double dspic_system_pll_hz(struct dspic *chip)
{
    static const double POST[] = {2.0, 4.0, 4.0, 8.0};
    const uint16_t clkdiv = *dspic_chip_sfr(chip, CLKDIV);
    const double input = dspic_system_frc_hz(chip) / ((clkdiv & 31u) + 2.0),
                 vco = input * (*dspic_chip_sfr(chip, PLLFBD) + 2.0);
    if (input < 0.8e6 || input > 8e6 || vco < 100e6 || vco > 200e6)
        chip->violations.overclocked++;
    return vco / POST[clkdiv >> CLKDIV_PLLPOST_SHIFT & 3u];
}

bool system_runs_on_pll(const struct dspic *chip)
{
    return ((unsigned)chip->sfr[OSCCON / 2u] >> OSCCON_COSC_SHIFT & 7u) == OSC_FRC_PLL;
}

void system_clock(struct dspic *chip)
{
    const uint64_t old = chip->cycle_fs;
    const bool pll = system_runs_on_pll(chip);
    const double fcy = (pll ? dspic_system_pll_hz(chip) : dspic_system_frc_hz(chip)) / 2.0;
    chip->violations.overclocked += fcy > FCY_MAX_HZ;
    chip->cycle_fs = (uint64_t)(FS_PER_S / fcy + 0.5);
    if (old)
        timers_rescale(chip, old);
}

uint32_t dspic_fcy_hz(const struct dspic *chip)
{
    return (uint32_t)(FS_PER_S / (double)chip->cycle_fs + 0.5);
}

void system_pll_event(struct dspic *chip)
{
    uint16_t *osccon = dspic_chip_sfr(chip, OSCCON);
    const unsigned wanted = *osccon >> OSCCON_NOSC_SHIFT & 7u;
    *osccon =
        (uint16_t)((*osccon & ~(7u << OSCCON_COSC_SHIFT | OSCCON_OSWEN | OSCCON_LOCK)) | wanted << OSCCON_COSC_SHIFT);
    if (wanted == OSC_FRC_PLL)
        *osccon |= OSCCON_LOCK;
    system_clock(chip);
    dspic_watchdog_restart(chip);
}

void dspic_watchdog_restart(struct dspic *chip)
{
    const uint64_t period = chip->parameters.watchdog_ms * (DSPIC_FS_PER_NS * 1000000u);
    dspic_plan_event(chip, EVENT_WATCHDOG, *dspic_chip_sfr(chip, RCON) & RCON_SWDTEN ? chip->now_fs + period : NEVER);
}

void dspic_clear_watchdog(struct dspic *chip)
{
    dspic_watchdog_restart(chip);
    dspic_spend(chip, 1u);
}

/* The model's time passes in dspic_run_until. The watchdog begins anew here too, as at its end (A). */
void dspic_idle(struct dspic *chip)
{
    chip->idle = true;
    dspic_watchdog_restart(chip);
}

void system_wake(struct dspic *chip)
{
    if (!chip->idle)
        return;
    *dspic_chip_sfr(chip, RCON) |= RCON_IDLE;
    chip->idle = false;
    dspic_watchdog_restart(chip);
}

/* It wakes an idle CPU and resets any other (C). */
void dspic_watchdog_event(struct dspic *chip)
{
    if (!chip->idle || chip->hung || chip->level > 0)
        dspic_reset(chip, RCON_WDTO);
    *dspic_chip_sfr(chip, RCON) |= RCON_WDTO;
    system_wake(chip);
    chip->wiring.loop(chip->wiring.context);
}

/* Values after any reset; RCON keeps what it knew and adds the cause. */
void system_reset(struct dspic *chip, uint16_t cause)
{
    const bool cold = cause & (RCON_POR | RCON_BOR);
    const uint16_t rcon = cause & RCON_POR ? 0 : *dspic_chip_sfr(chip, RCON) & (uint16_t)~RCON_SWDTEN;
    const uint16_t clock = 7u << OSCCON_COSC_SHIFT | 7u << OSCCON_NOSC_SHIFT | OSCCON_LOCK;
    const uint16_t osccon = chip->parameters.keeps_clock && !cold ? *dspic_chip_sfr(chip, OSCCON) & clock : 0;
    memset(chip->sfr, 0, sizeof chip->sfr);
    memset(chip->spi, 0, sizeof chip->spi);
    memset(chip->dma, 0, sizeof chip->dma);
    memset(chip->timer, 0, sizeof chip->timer);
    for (enum event e = EVENT_SPI1; e < EVENT_POWER; e++)
        chip->due_fs[e] = NEVER;
    chip->level = 0;
    chip->idle = chip->hung = false;
    chip->requested = 0;
    chip->held_fs = 0;
    chip->computed_for = 0;
    chip->high_key = chip->low_key = chip->flash_key = 0;
    chip->pins_were_locked = false;
    *dspic_chip_sfr(chip, RCON) = rcon | cause;
    *dspic_chip_sfr(chip, OSCCON) = osccon;
    *dspic_chip_sfr(chip, TRISB) = 0xFFFFu;
    *dspic_chip_sfr(chip, PR1) = *dspic_chip_sfr(chip, PR2) = *dspic_chip_sfr(chip, PR3) = 0xFFFFu;
    *dspic_chip_sfr(chip, CLKDIV) = 0x0040u; /* N1 2, N2 4, M 50 */
    *dspic_chip_sfr(chip, PLLFBD) = 48u;
    for (unsigned n = 0; n < (IRQ_COUNT + 3u) / 4u; n++)
        *dspic_chip_sfr(chip, IPC0 + 2u * n) = 0x4444u;
    for (unsigned n = 0; n <= 26u; n++)
        *dspic_chip_sfr(chip, RPINR0 + 2u * n) = 0x1F1Fu;
    chip->cycle_fs = 0;
    system_clock(chip);
    pins_refresh(chip);
}
