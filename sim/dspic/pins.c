/* Port B, open-drain outputs and the peripheral pin select. */
#include <string.h>

#include "dspic_chip.h"

unsigned pin_input_field(const struct dspic *chip, unsigned address, unsigned shift)
{
    return (unsigned)chip->sfr[address / 2u] >> shift & 31u;
}

bool pin_level(const struct dspic *chip, unsigned field)
{
    return field < 16u && (chip->inputs >> field & 1u);
}

static unsigned dspic_pins_function_of(const struct dspic *chip, unsigned rp)
{
    return (unsigned)chip->sfr[RPOR0 / 2u + rp / 2u] >> (8u * (rp % 2u)) & 31u;
}

static enum dspic_drive dspic_pins_drive_of(const struct dspic *chip, unsigned rp)
{
    const unsigned function = dspic_pins_function_of(chip, rp), mask = 1u << rp;
    bool level = chip->sfr[LATB / 2u] & mask, driven = !(chip->sfr[TRISB / 2u] & mask);
    if (function == RP_SDO1 || function == RP_SCK1 || function == RP_SDO2)
        spi_drives(chip, function, &driven, &level);
    if (!driven || (level && chip->sfr[ODCB / 2u] & mask))
        return DSPIC_FLOAT;
    return level ? DSPIC_HIGH : DSPIC_LOW;
}

static void dspic_pins_refresh(struct dspic *chip, unsigned rp)
{
    const enum dspic_drive now = dspic_pins_drive_of(chip, rp);
    if (now == chip->drive[rp])
        return;
    chip->drive[rp] = (uint8_t)now;
    if (chip->wiring.pin)
        chip->wiring.pin(chip->wiring.context, rp, now, chip->now_fs);
}

void pins_refresh(struct dspic *chip)
{
    memset(chip->spi_pin, 16, sizeof chip->spi_pin);
    for (unsigned rp = 0; rp < 16u; rp++) {
        const unsigned function = dspic_pins_function_of(chip, rp);
        if (function == RP_SCK1)
            chip->spi_pin[0][0] = (uint8_t)rp;
        else if (function == RP_SDO1 || function == RP_SDO2)
            chip->spi_pin[function == RP_SDO2][1] = (uint8_t)rp;
        dspic_pins_refresh(chip, rp);
    }
}

/* Data before clock: the other end samples on the clock's edge. */
void pins_of_spi(struct dspic *chip, unsigned n)
{
    for (unsigned i = 2; i-- > 0;) {
        if (chip->spi_pin[n][i] < 16u)
            dspic_pins_refresh(chip, chip->spi_pin[n][i]);
    }
}

enum dspic_drive dspic_output(const struct dspic *chip, unsigned rp)
{
    return (enum dspic_drive)chip->drive[rp];
}

void dspic_wire(struct dspic *chip, unsigned rp, bool level)
{
    chip->inputs = (uint16_t)((chip->inputs & ~(1u << rp)) | (unsigned)level << rp);
}
