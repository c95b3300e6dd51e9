/* The chip as a whole: its making, its supply, the firmware that runs on it, what comes in from outside. */
#include <stdlib.h>

#include "dspic_chip.h"

void dspic_parameters_default(struct dspic_parameters *parameters)
{
    *parameters = (struct dspic_parameters){.slave_prefetch = 2,
                                            .entry_cycles = 5,
                                            .exit_cycles = 3,
                                            .pll_lock_us = 1000,
                                            .keeps_clock = true,
                                            .watchdog_ms = 128,
                                            .pins_lock_once = true,
                                            .device_id = 0x0629,
                                            .serial = UINT32_MAX};
}

struct dspic *dspic_new(const struct dspic_parameters *parameters, const struct dspic_wiring *wiring)
{
    struct dspic *chip = calloc(1, sizeof *chip);
    if (!chip)
        return NULL;
    chip->parameters = *parameters;
    chip->wiring = *wiring;
    chip->random = parameters->seed | 1u;
    for (unsigned e = 0; e < EVENTS; e++)
        chip->due_fs[e] = NEVER;
    for (unsigned i = 0; i < FLASH_WORDS; i++)
        chip->flash[i] = 0xFFFFFFu; /* erased */
    for (unsigned rp = 0; rp < 16u; rp++)
        chip->drive[rp] = DSPIC_FLOAT;
    return chip;
}

void dspic_free(struct dspic *chip)
{
    free(chip);
}

void dspic_chip_throw_out(struct dspic *chip, uint16_t cause)
{
    chip->cause = cause;
    longjmp(*chip->unwind, 1);
}

void dspic_reset(struct dspic *chip, uint16_t cause)
{
    dspic_chip_throw_out(chip, cause);
}

static void dspic_boot(struct dspic *chip)
{
    system_reset(chip, chip->cause);
    chip->in_start = true;
    chip->wiring.start(chip->wiring.context);
    chip->in_start = false;
    dspic_irq_take(chip);
}

static void dspic_lose_power(struct dspic *chip)
{
    chip->powered = false;
    for (unsigned e = 0; e < EVENT_OUTSIDE; e++)
        chip->due_fs[e] = NEVER;
    for (unsigned rp = 0; rp < 16u; rp++)
        chip->drive[rp] = DSPIC_FLOAT;
}

void dspic_chip_enter(struct dspic *chip, chip_step *first, chip_step *again, uint64_t argument)
{
    jmp_buf here;
    jmp_buf *outer = chip->unwind;
    chip_step *volatile next = first;
    chip->unwind = &here;
    if (setjmp(here) != 0) {
        if (chip->cause == 0) {
            dspic_lose_power(chip);
            next = NULL;
        } else {
            dspic_boot(chip);
            next = again;
        }
    }
    if (next)
        next(chip, argument);
    chip->unwind = outer;
}

static void dspic_run(struct dspic *chip, uint64_t until_fs)
{
    dspic_irq_take(chip);
    while (chip->soon_fs <= until_fs) {
        events_pass(chip, chip->soon_fs);
        dspic_irq_take(chip);
    }
    if (until_fs > chip->now_fs)
        chip->now_fs = until_fs;
}

static void dspic_run_boot(struct dspic *chip, uint64_t argument)
{
    (void)argument;
    dspic_boot(chip);
}

void dspic_power_on(struct dspic *chip, uint64_t now_fs)
{
    if (now_fs > chip->now_fs)
        chip->now_fs = now_fs;
    chip->powered = true;
    chip->cause = RCON_POR | RCON_BOR;
    dspic_chip_enter(chip, dspic_run_boot, dspic_run_boot, 0);
}

void dspic_power_off(struct dspic *chip, uint64_t now_fs)
{
    if (chip->unwind)
        dspic_chip_throw_out(chip, 0);
    dspic_run_until(chip, now_fs);
    dspic_lose_power(chip);
}

static void dspic_run_dark(struct dspic *chip, uint64_t until_fs)
{
    while (!chip->powered && chip->due_fs[EVENT_OUTSIDE] <= until_fs) {
        if (chip->due_fs[EVENT_OUTSIDE] > chip->now_fs)
            chip->now_fs = chip->due_fs[EVENT_OUTSIDE];
        event_handle(chip, EVENT_OUTSIDE);
    }
}

void dspic_run_until(struct dspic *chip, uint64_t until_fs)
{
    do {
        dspic_run_dark(chip, until_fs);
        if (chip->powered)
            dspic_chip_enter(chip, dspic_run, dspic_run, until_fs);
    } while (!chip->powered && chip->due_fs[EVENT_OUTSIDE] <= until_fs);
    if (until_fs > chip->now_fs)
        chip->now_fs = until_fs;
}

bool dspic_powered(const struct dspic *chip)
{
    return chip->powered;
}

void dspic_input(struct dspic *chip, unsigned rp, bool level, uint64_t now_fs)
{
    if (now_fs > chip->now_fs)
        dspic_run_until(chip, now_fs);
    if (level == (((unsigned)chip->inputs >> rp & 1u) != 0))
        return;
    dspic_wire(chip, rp, level);
    if (!chip->powered)
        return;
    spi_input(chip, rp, level);
    const uint16_t edges = *dspic_chip_sfr(chip, INTCON2);
    if (pin_input_field(chip, RPINR0, 8u) == rp && level != (bool)(edges & INTCON2_INT1EP))
        dspic_irq_raise(chip, IRQ_INT1);
    if (pin_input_field(chip, RPINR1, 0) == rp && level != (bool)(edges & INTCON2_INT2EP))
        dspic_irq_raise(chip, IRQ_INT2);
}

uint64_t dspic_busy_fs(const struct dspic *chip)
{
    return chip->busy_fs;
}

uint64_t dspic_interrupts(const struct dspic *chip)
{
    return chip->interrupts;
}

struct dspic_violations dspic_violations(const struct dspic *chip)
{
    return chip->violations;
}
