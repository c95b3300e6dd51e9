#include <stdlib.h>

#include "dspic_chip.h"

void dspic_parameters_default(struct dspic_parameters *parameters)
{
    *parameters = (struct dspic_parameters){.slave_prefetch = 2,
                                            .entry_cycles = 5,
                                            .exit_cycles = 3,
                                            .work_cycles = 60,
                                            .pll_lock_us = 1000,
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

static enum event next_event(const struct dspic *chip)
{
    enum event next = EVENT_SPI1;
    for (enum event e = EVENT_SPI1; e < EVENTS; e++) {
        if (chip->due_fs[e] < chip->due_fs[next])
            next = e;
    }
    return next;
}

/* Leaves the running firmware, wherever it is: a reset (cause RCON_*) or the end of the supply (0). */
static void throw_out(struct dspic *chip, uint16_t cause)
{
    chip->cause = cause;
    longjmp(*chip->unwind, 1);
}

void dspic_reset(struct dspic *chip, uint16_t cause)
{
    throw_out(chip, cause);
}

static void handle(struct dspic *chip, enum event event)
{
    chip->due_fs[event] = NEVER;
    switch (event) {
    case EVENT_SPI1:
    case EVENT_SPI2:
        spi_event(chip, event - EVENT_SPI1);
        break;
    case EVENT_T1:
    case EVENT_T2:
    case EVENT_T3:
        timer_event(chip, event - EVENT_T1);
        break;
    case EVENT_DMA:
        dma_event(chip);
        break;
    case EVENT_PLL:
        system_pll_event(chip);
        break;
    case EVENT_DISI:
        chip->look = true;
        break;
    case EVENT_WATCHDOG:
        watchdog_event(chip);
        break;
    case EVENT_POWER:
        throw_out(chip, 0);
        break;
    case EVENT_OUTSIDE:
        chip->wiring.outside(chip->wiring.context);
        break;
    default:
        break;
    }
}

void plan_event(struct dspic *chip, enum event event, uint64_t at_fs)
{
    chip->due_fs[event] = at_fs;
    if (at_fs < chip->soon_fs)
        chip->soon_fs = at_fs;
}

/* Lets everything happen that is due up to `until_fs`, interrupts apart. */
static void pass(struct dspic *chip, uint64_t until_fs)
{
    while (chip->soon_fs <= until_fs) {
        const enum event e = next_event(chip);
        chip->soon_fs = chip->due_fs[e];
        if (chip->soon_fs > until_fs)
            break;
        if (chip->soon_fs > chip->now_fs)
            chip->now_fs = chip->soon_fs;
        handle(chip, e);
    }
    if (until_fs > chip->now_fs)
        chip->now_fs = until_fs;
}

void dspic_stall(struct dspic *chip, uint64_t until_fs)
{
    pass(chip, until_fs);
}

void dspic_spend(struct dspic *chip, uint64_t cycles)
{
    pass(chip, chip->now_fs + cycles * chip->cycle_fs);
    irq_take(chip);
}

static void boot(struct dspic *chip)
{
    system_reset(chip, chip->cause);
    chip->in_start = true;
    chip->wiring.start(chip->wiring.context);
    chip->in_start = false;
    irq_take(chip);
}

static void lose_power(struct dspic *chip)
{
    chip->powered = false;
    for (unsigned e = 0; e < EVENT_OUTSIDE; e++)
        chip->due_fs[e] = NEVER;
    for (unsigned rp = 0; rp < 16u; rp++)
        chip->drive[rp] = DSPIC_FLOAT;
}

typedef void step(struct dspic *chip, uint64_t argument);

/* Runs a step that may run firmware; a reset within it boots the chip and goes on in `again`. */
static void enter(struct dspic *chip, step *first, step *again, uint64_t argument)
{
    jmp_buf here;
    jmp_buf *outer = chip->unwind;
    step *volatile next = first;
    chip->unwind = &here;
    if (setjmp(here) != 0) {
        if (chip->cause == 0) {
            lose_power(chip);
            next = NULL;
        } else {
            boot(chip);
            next = again;
        }
    }
    if (next)
        next(chip, argument);
    chip->unwind = outer;
}

static void run(struct dspic *chip, uint64_t until_fs)
{
    irq_take(chip);
    while (chip->soon_fs <= until_fs) {
        pass(chip, chip->soon_fs);
        irq_take(chip);
    }
    if (until_fs > chip->now_fs)
        chip->now_fs = until_fs;
}

static void run_boot(struct dspic *chip, uint64_t argument)
{
    (void)argument;
    boot(chip);
}

void dspic_power_on(struct dspic *chip, uint64_t now_fs)
{
    if (now_fs > chip->now_fs)
        chip->now_fs = now_fs;
    chip->powered = true;
    chip->cause = RCON_POR | RCON_BOR;
    enter(chip, run_boot, run_boot, 0);
}

void dspic_power_off(struct dspic *chip, uint64_t now_fs)
{
    if (chip->unwind)
        throw_out(chip, 0);
    dspic_run_until(chip, now_fs);
    lose_power(chip);
}

static void run_dark(struct dspic *chip, uint64_t until_fs)
{
    while (!chip->powered && chip->due_fs[EVENT_OUTSIDE] <= until_fs) {
        if (chip->due_fs[EVENT_OUTSIDE] > chip->now_fs)
            chip->now_fs = chip->due_fs[EVENT_OUTSIDE];
        handle(chip, EVENT_OUTSIDE);
    }
}

void dspic_run_until(struct dspic *chip, uint64_t until_fs)
{
    do {
        run_dark(chip, until_fs);
        if (chip->powered)
            enter(chip, run, run, until_fs);
    } while (!chip->powered && chip->due_fs[EVENT_OUTSIDE] <= until_fs);
    if (until_fs > chip->now_fs)
        chip->now_fs = until_fs;
}

void dspic_outside_at(struct dspic *chip, uint64_t at_fs)
{
    plan_event(chip, EVENT_OUTSIDE, at_fs);
}

uint64_t dspic_now_fs(const struct dspic *chip)
{
    return chip->now_fs;
}

uint64_t dspic_next_fs(const struct dspic *chip)
{
    return chip->due_fs[next_event(chip)];
}

void dspic_cut_power_at(struct dspic *chip, uint64_t at_fs)
{
    plan_event(chip, EVENT_POWER, at_fs);
}

bool dspic_powered(const struct dspic *chip)
{
    return chip->powered;
}

static void nothing(struct dspic *chip, uint64_t argument)
{
    (void)chip;
    (void)argument;
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
    const uint16_t edges = *sfr(chip, INTCON2);
    if (pin_input_field(chip, RPINR0, 8u) == rp && level != (bool)(edges & INTCON2_INT1EP))
        irq_raise(chip, IRQ_INT1);
    if (pin_input_field(chip, RPINR1, 0) == rp && level != (bool)(edges & INTCON2_INT2EP))
        irq_raise(chip, IRQ_INT2);
}

static void be_reset(struct dspic *chip, uint64_t cause)
{
    throw_out(chip, (uint16_t)cause);
}

void dspic_disturb_reset(struct dspic *chip, uint16_t cause)
{
    if (chip->unwind)
        throw_out(chip, cause);
    else if (chip->powered)
        enter(chip, be_reset, nothing, cause);
}

enum { TRAP_LEVEL = 15 }; /* above every interrupt */

static void be_trapped(struct dspic *chip, uint64_t trap)
{
    static const uint16_t FLAG[] = {INTCON1_OSCFAIL, INTCON1_STKERR, INTCON1_ADDRERR, INTCON1_MATHERR, INTCON1_DMACERR};
    *sfr(chip, INTCON1) |= FLAG[trap];
    const unsigned before = chip->level;
    chip->level = TRAP_LEVEL;
    chip->wiring.trap(chip->wiring.context, (enum dspic_trap)trap);
    chip->level = before;
}

void dspic_disturb_trap(struct dspic *chip, enum dspic_trap trap)
{
    if (chip->unwind)
        be_trapped(chip, trap);
    else if (chip->powered)
        enter(chip, be_trapped, nothing, trap);
}

void dspic_disturb_collision(struct dspic *chip, unsigned channel, bool peripheral)
{
    *sfr(chip, DMACS0) |= (uint16_t)(1u << (channel + (peripheral ? DMACS0_PERIPHERAL_SHIFT : 0u)));
    dspic_disturb_trap(chip, DSPIC_TRAP_DMA);
}

void dspic_disturb_hang(struct dspic *chip)
{
    chip->hung = chip->powered;
}

void dspic_disturb_unread(struct dspic *chip, unsigned spi)
{
    *sfr(chip, spi == 1u ? SPI1STAT : SPI2STAT) |= SPISTAT_SPIRBF;
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
