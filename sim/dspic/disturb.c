/* What a test does to the chip that its surroundings would not: resets, traps, hangs. */
#include "dspic_chip.h"

static void dspic_disturb_nothing(struct dspic *chip, uint64_t argument)
{
    (void)chip;
    (void)argument;
}

static void dspic_disturb_be_reset(struct dspic *chip, uint64_t cause)
{
    dspic_chip_throw_out(chip, (uint16_t)cause);
}

void dspic_disturb_reset(struct dspic *chip, uint16_t cause)
{
    if (chip->unwind)
        dspic_chip_throw_out(chip, cause);
    else if (chip->powered)
        dspic_chip_enter(chip, dspic_disturb_be_reset, dspic_disturb_nothing, cause);
}

enum { TRAP_LEVEL = 15 }; /* above every interrupt */

static void dspic_disturb_be_trapped(struct dspic *chip, uint64_t trap)
{
    static const uint16_t FLAG[] = {INTCON1_OSCFAIL, INTCON1_STKERR, INTCON1_ADDRERR, INTCON1_MATHERR, INTCON1_DMACERR};
    *dspic_chip_sfr(chip, INTCON1) |= FLAG[trap];
    const unsigned before = chip->level;
    chip->level = TRAP_LEVEL;
    chip->wiring.trap(chip->wiring.context, (enum dspic_trap)trap);
    chip->level = before;
}

void dspic_disturb_trap(struct dspic *chip, enum dspic_trap trap)
{
    if (chip->unwind)
        dspic_disturb_be_trapped(chip, trap);
    else if (chip->powered)
        dspic_chip_enter(chip, dspic_disturb_be_trapped, dspic_disturb_nothing, trap);
}

void dspic_disturb_collision(struct dspic *chip, unsigned channel, bool peripheral)
{
    *dspic_chip_sfr(chip, DMACS0) |= (uint16_t)(1u << (channel + (peripheral ? DMACS0_PERIPHERAL_SHIFT : 0u)));
    dspic_disturb_trap(chip, DSPIC_TRAP_DMA);
}

void dspic_disturb_hang(struct dspic *chip)
{
    chip->hung = chip->powered;
}

void dspic_disturb_unread(struct dspic *chip, unsigned spi)
{
    *dspic_chip_sfr(chip, spi == 1u ? SPI1STAT : SPI2STAT) |= SPISTAT_SPIRBF;
}
